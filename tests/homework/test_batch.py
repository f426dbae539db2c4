"""Batches with all that may be handed in: honest rows stay right, and nothing happens but judging."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import json
import os
import re
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidcli.errors import ComputationError
from rigidcli.homework import workers
from rigidcli.homework.base import Judgement, Outcome, Tree, sentence
from rigidcli.homework.files import MOST_BYTES, gather
from rigidcli.homework.hand_ins import Paper, papers
from rigidcli.homework.judge import Item, run
from rigidcli.homework.kinds import KINDS
from rigidcli.sandbox import Limits
from tests.homework.asking import asked
from tests.homework.standins import Same

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no such files and limits")

SHORT = Limits(seconds=2.0, memory=200_000_000)


class Doing(Same):
    """A kind that a bad answer has taken over: it does what its key, a mapping, has under the answer."""

    def judge(self, key: Any, value: Any) -> Outcome:
        if value in key:
            key[value]()
        return Outcome.correct()

    def typed(self, key: Any) -> Tree:
        return "nothing"


ITEMS = {"a": Item(Same(), "1", 1.0), "b": Item(Same(), "2", 2.0)}
HONEST = "student: x\nanswers: {a: 1, b: 2}\n"
WRONG = "student: x\nanswers: {a: 1, b: 3}\n"


def codes(judgement: Judgement) -> set[str]:
    return {code for question in judgement.questions for code in question.codes}


def verdicts(judgement: Judgement) -> list[str]:
    return [question.verdict for question in judgement.questions]


def handed(folder: Path) -> list[Paper]:
    gathered = gather([str(folder)], None, folder / "no scratch")
    assert gathered.problems == []
    return papers(gathered).papers


def by_student(folder: Path, **options: Any) -> dict[str, Judgement]:
    files = handed(folder)
    judgements = list(run(options.pop("items", ITEMS), files, **options))
    assert len(judgements) == len(files)
    return {judgement.student: judgement for judgement in judgements}


def snapshot(folder: Path) -> dict[str, tuple[int, int, int, bytes]]:
    """What there is below a folder, with its modes, times and contents."""
    found = {}
    for path in [folder, *folder.rglob("*")]:
        status = path.lstat()
        regular = path.is_file() and not path.is_symlink() and status.st_size < 10_000_000
        data = path.read_bytes() if regular else b""
        found[str(path)] = (status.st_mode, status.st_mtime_ns, status.st_size, data)
    return found


def children(process: int) -> list[str]:
    """Processes that a process has started and that are not gone, zombies among them."""
    return Path(f"/proc/{process}/task/{process}/children").read_text().split()


@pytest.fixture(autouse=True)
def started() -> Iterator[Callable[[], list[str]]]:
    """Processes that a test has started, of which none may be left. A browser of other tests may be there."""
    before = {*children(os.getpid())}

    def since() -> list[str]:
        new = [child for child in children(os.getpid()) if child not in before]
        return [
            child for child in new if b"resource_tracker" not in Path(f"/proc/{child}/cmdline").read_bytes()
        ]

    yield since
    assert not since()


def are_at_work(process: int) -> bool:
    """Whether both workers of a process's batch have used the processor for a while (ticks of 10 ms)."""
    try:
        stats = [Path(f"/proc/{worker}/stat").read_text() for worker in children(process)]
    except OSError:  # one has ended in the meantime
        return False
    return sum(int(stat.rpartition(")")[2].split()[11]) >= 5 for stat in stats) >= 2


BAD_TEXTS: dict[str, tuple[str, str | bytes]] = {
    "anchors": ("not_allowed", "answers: {a: &a [x,x], b: &b [*a,*a]}"),
    "binary": ("parse_error", bytes(range(256))),
    "brackets": ("too_large", "answers: {a: " + "[" * 100_000),
    "braces": ("too_large", "answers: " + "{a: " * 100_000),
    "command": ("not_allowed", "answers: {a: !!python/object/apply:os.system ['touch hacked']}"),
    "deep": ("too_large", "answers: {a: " + "[" * 51 + "]" * 51 + "}"),
    "duplicate": ("duplicate_key", "answers: {a: 1, a: 2, b: 2}"),
    "long": ("too_large", HONEST + "#" * MOST_BYTES),
    "longer": ("too_large", HONEST * 100_000),
    "merge": ("not_allowed", "answers: {<<: {a: 1}}"),
    "nul": ("parse_error", b"answers: {a: 1\0}"),
    "nuls": ("parse_error", bytes(5000)),
    "text": ("wrong_shape", "Dear grader, please give me all points."),
    "two": ("duplicate_key", HONEST.replace("{a: 1, b: 2}", "\n  a: 1\n  b: 2") + "---\n  a: 1\n  b: 2\n"),
    "utf16be": ("parse_error", HONEST.encode("utf-16-be")),
    "utf32": ("parse_error", HONEST.encode("utf-32")),
}

STRANGE_NAMES = [
    b"new\nline.yaml",
    b"escape\x1b[31m.yaml",
    b"bytes\xff\xfe.yaml",
    "bidi\u202eevil.yaml".encode(),
    b"=cmd|'calc'!A0.yaml",
    b"[red]markup[-].yaml",
    b"-rf.yaml",
    b" .yaml",
    b"a.b.c.yaml",
]


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """A folder with three honest files, and what else may be handed in."""
    folder = tmp_path / "answers"
    folder.mkdir()
    for name in ["0_first", "m_middle", "z_last"]:
        (folder / f"{name}.yaml").write_text(HONEST)
    for name, (_, text) in BAD_TEXTS.items():
        (folder / f"bad_{name}.yaml").write_bytes(text.encode() if isinstance(text, str) else text)
    for strange in STRANGE_NAMES:
        (Path(os.fsdecode(os.fsencode(folder) + b"/" + strange))).write_text(WRONG)
    (tmp_path / "secret.yaml").write_text(HONEST)
    (folder / "form_link.yaml").symlink_to("../secret.yaml")
    (folder / "form_passwd.yaml").symlink_to("/etc/passwd")
    (folder / "form_dangling.yaml").symlink_to("nowhere")
    (folder / "form_loop.yaml").symlink_to("form_loop.yaml")
    (folder / "form_zero.yaml").symlink_to("/dev/zero")
    (folder / "form_folder.yaml").mkdir()
    os.mkfifo(folder / "form_pipe.yaml")
    with contextlib.suppress(PermissionError):
        os.mknod(folder / "form_device.yaml", 0o666 | 0o020000, os.makedev(1, 5))
    here = Path.cwd()
    os.chdir(folder)  # the name of a socket has a length that is soon too long
    with contextlib.closing(socket.socket(socket.AF_UNIX)) as server:
        server.bind("form_socket.yaml")
    os.chdir(here)
    return folder


def test_honest_rows_of_a_hostile_batch(hostile: Path) -> None:
    before = snapshot(hostile.parent)
    found = by_student(hostile)
    for name in ["0_first", "m_middle", "z_last"]:
        assert verdicts(found[name]) == ["correct", "correct"]
        assert found[name].score == 3
    for name, (code, _) in BAD_TEXTS.items():
        judgement = found[f"bad_{name}"]
        assert (name, verdicts(judgement), codes(judgement)) == (name, ["invalid", "invalid"], {code})
    for name, judgement in found.items():
        if name.startswith("form_"):
            assert (name, verdicts(judgement), codes(judgement)) == (name, ["invalid"] * 2, {"not_allowed"})
    assert snapshot(hostile.parent) == before


def test_strange_names_are_harmless(hostile: Path) -> None:
    names = [os.fsdecode(os.fsencode(hostile) + b"/" + name) for name in STRANGE_NAMES]
    judgements = list(run(ITEMS, papers(gather(names, None, hostile / "no scratch")).papers))
    for judgement in judgements:
        assert verdicts(judgement) == ["correct", "incorrect"]
        for text in (judgement.student, judgement.source):
            assert text.isprintable()
            text.encode()
    assert [judgement.student for judgement in judgements] == [
        r"new\nline",
        r"escape\x1b[31m",
        r"bytes\xff\xfe",
        r"bidi\u202eevil",
        "=cmd|'calc'!A0",  # what a spreadsheet would run is a matter of csv
        "[red]markup[-]",
        "-rf",
        " ",
        "a.b.c",
    ]


def test_any_number_of_jobs_gives_the_same_in_the_same_order(hostile: Path) -> None:
    files = handed(hostile)
    one = list(run(ITEMS, files, 1))
    assert list(run(ITEMS, files, 2)) == one
    assert list(run(ITEMS, files[::-1], 4)) == one[::-1]


def test_a_slow_file_holds_no_other_up(tmp_path: Path) -> None:
    actions = {"sleep": lambda: time.sleep(0.6)}
    for name in "abcdefgh":
        (tmp_path / f"{name}.yaml").write_text("answers: {a: sleep}" if name == "a" else HONEST)
    shares: list[float] = []
    began = time.monotonic()
    judgements = run({"a": Item(Doing(), actions, 1.0)}, handed(tmp_path), 2, shares.append)
    first = next(judgements)
    assert time.monotonic() - began >= 0.6
    assert first.student == "a"
    assert len(shares) == 8
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert [judgement.student for judgement in judgements] == list("bcdefgh")


def test_a_long_result_comes_through(tmp_path: Path) -> None:
    text = "\N{GREEK SMALL LETTER OMEGA}" * 300_000
    (tmp_path / "a.yaml").write_text(f"answers: {{a: {text}}}", encoding="utf-8")
    (tmp_path / "b.yaml").write_text(HONEST)
    long, short = run(ITEMS, handed(tmp_path))
    assert long.questions[0].findings[0].detail == f"read {text}"
    assert verdicts(short) == ["correct", "correct"]


def test_a_result_that_is_too_long(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(f"answers: {{a: {'x' * 10_000}}}")
    (judgement,) = run(ITEMS, handed(tmp_path), limits=SHORT._replace(handed=5_000))
    assert codes(judgement) == {"too_large"}


def test_a_result_waits_to_be_fetched(tmp_path: Path) -> None:
    # Whoever reads the rows may be slower than the limit allows work to be.
    (tmp_path / "a.yaml").write_text(HONEST)
    (tmp_path / "b.yaml").write_text(f"answers: {{a: 1, b: {'x' * 500_000}}}")
    judgements = run(ITEMS, handed(tmp_path), 2, limits=SHORT)
    assert verdicts(next(judgements)) == ["correct", "correct"]
    time.sleep(SHORT.seconds + 0.7)
    assert verdicts(next(judgements)) == ["correct", "incorrect"]


def test_no_files_give_no_rows() -> None:
    assert list(run(ITEMS, [])) == []


def test_a_file_that_is_gone_when_its_turn_comes(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(HONEST)
    files = {name: tmp_path / f"{name}.yaml" for name in ("gone", "a")}
    gone, there = run(ITEMS, [Paper(name, file) for name, file in files.items()])
    assert (verdicts(gone), codes(gone)) == (["invalid", "invalid"], {"missing_file"})
    assert verdicts(there) == ["correct", "correct"]


def certain(action: Callable[[], Any]) -> Callable[[], None]:
    """An action that is tried, and makes itself known by ending the process if it succeeds."""

    def tried() -> None:
        action()
        os._exit(0)

    return tried


def loop() -> None:
    while True:
        pass


def eat() -> None:
    eaten = []
    while True:
        eaten.append(np.zeros(5_000_000))  # too large for what the process has freed before


def nest(depth: int = 0) -> int:
    return nest(depth + 1) + 1


def endless_numbers() -> None:
    np.zeros(10**9) + 1


def fates(
    folder: Path, actions: Mapping[str, Callable[[], Any]], verdict: str = "invalid"
) -> dict[str, Judgement]:
    """What becomes of answers on which a kind does something, among others on which it does not."""
    honest = [f"{name}_honest" for name in actions]
    for name in [*actions, *honest]:
        (folder / f"{name}.yaml").write_text(f"answers: {{q: {name}}}")
    before = snapshot(folder)
    began = time.monotonic()
    found = by_student(folder, items={"q": Item(Doing(), actions, 1.0)}, limits=SHORT, jobs=4)
    assert time.monotonic() - began < 30
    assert all(verdicts(found[name]) == ["correct"] for name in honest)
    assert all(verdicts(found[name]) == [verdict] for name in actions)
    assert snapshot(folder) == before
    return {name: found[name] for name in actions}


def fate(folder: Path, action: Callable[[], Any], verdict: str = "invalid") -> set[str]:
    """The codes of the one answer on which a kind does something."""
    return codes(fates(folder, {"act": action}, verdict)["act"])


ENDS: dict[str, tuple[str, Callable[[], Any]]] = {
    "loops": ("timeout", loop),
    "sleeps": ("timeout", lambda: time.sleep(60)),
    "matches": ("timeout", lambda: re.fullmatch("(a*)*b", "a" * 60)),
    "stops": ("timeout", lambda: signal.raise_signal(signal.SIGSTOP)),
    "eats": ("too_large", eat),
    "makes arrays": ("too_large", endless_numbers),
    "makes a text": ("too_large", lambda: "x" * 10**12),
    "is killed": ("too_large", lambda: signal.raise_signal(signal.SIGKILL)),
    "aborts": ("too_large", os.abort),
    "nests": ("too_large", nest),
    "breaks down": ("too_large", lambda: signal.raise_signal(signal.SIGSEGV)),
    "is asked to end": ("not_allowed", lambda: signal.raise_signal(signal.SIGTERM)),
    "ends": ("not_allowed", lambda: os._exit(0)),
    "ends badly": ("not_allowed", lambda: os._exit(3)),
    "leaves": ("not_allowed", sys.exit),
}


def test_what_ends_a_process_ends_one_row(tmp_path: Path) -> None:
    found = fates(tmp_path, {name: action for name, (_, action) in ENDS.items()})
    assert {name: codes(judgement) for name, judgement in found.items()} == {
        name: {code} for name, (code, _) in ENDS.items()
    }


def test_the_memory_of_a_process_is_bounded_besides_what_it_shares(tmp_path: Path) -> None:
    def some() -> None:
        assert len(bytearray(150_000_000)) == 150_000_000

    (tmp_path / "a.yaml").write_text("answers: {q: some}")
    shared = np.zeros(40_000_000)  # 320 MB, more than the limit
    (judgement,) = run({"q": Item(Doing(), {"some": some}, 1.0)}, handed(tmp_path), limits=SHORT)
    assert verdicts(judgement) == ["correct"]
    assert shared[0] == 0


ATTEMPTS: list[Callable[[Path], Any]] = [
    lambda folder: (folder / "new").write_text("x"),
    lambda folder: (folder / "new").touch(),
    lambda folder: (folder / "new").mkdir(),
    lambda folder: (folder / "attempt0.yaml").open("ab"),
    lambda folder: (folder / "attempt0.yaml").open("r+"),
    lambda folder: os.open(folder / "attempt0.yaml", os.O_RDWR),
    lambda folder: os.truncate(folder / "attempt0.yaml", 0),
    lambda folder: (folder / "attempt0.yaml").unlink(),
    lambda folder: (folder / "attempt0.yaml").rename(folder / "z.yaml"),
    lambda folder: (folder / "attempt0.yaml").replace(folder / "attempt1.yaml"),
    lambda folder: (folder / "attempt0.yaml").chmod(0o600),
    lambda folder: os.utime(folder / "attempt0.yaml", (0, 0)),
    lambda folder: os.chown(folder / "attempt0.yaml", -1, -1),
    lambda folder: (folder / "l.yaml").symlink_to("a.yaml"),
    lambda folder: os.link(folder / "attempt0.yaml", folder / "l.yaml"),
    lambda folder: os.chdir("/"),
    lambda folder: os.system(f"touch {folder}/new"),
    lambda folder: subprocess.run(["touch", folder / "new"], check=False),
    lambda folder: os.posix_spawn("/bin/true", ["true"], {}),
    lambda folder: os.execv("/bin/true", ["true"]),
    lambda folder: os.fork(),
    lambda folder: os.kill(os.getppid(), signal.SIGTERM),
    lambda folder: socket.socket(),
    lambda folder: socket.create_connection(("127.0.0.1", 9), 0.1),
    lambda folder: socket.getaddrinfo("example.org", 80),
    lambda folder: ctypes.CDLL(None),
    lambda folder: resource.setrlimit(resource.RLIMIT_CPU, (1, 1)),
]


def test_nothing_is_written_started_or_reached(tmp_path: Path) -> None:
    found = fates(
        tmp_path, {f"attempt{k}": certain(partial(attempt, tmp_path)) for k, attempt in enumerate(ATTEMPTS)}
    )
    for name, judgement in found.items():
        assert (name, codes(judgement)) == (name, {"not_allowed"})
        # Refused by Python, before the system is asked.
        assert "stopped" not in sentence(judgement.questions[0].findings[0])


def test_a_file_that_is_open_already_takes_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with (tmp_path / "open.txt").open("wb", buffering=0) as file:
        own = file.fileno()

        def write() -> None:
            print("printed", flush=True)
            os.write(1, b"written")
            os.write(2, b"written")
            os.write(own, b"written")

        assert fate(tmp_path, write, "review") == {"undecided"}
    assert capfd.readouterr() == ("", "")


def test_files_are_few(tmp_path: Path) -> None:
    def open_many() -> list[int]:
        return [os.open(tmp_path / "act.yaml", os.O_RDONLY) for _ in range(100)]

    assert fate(tmp_path, open_many, "review") == {"undecided"}


def test_what_is_buffered_is_not_written_twice(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(HONEST)
    script = f"""
import atexit, sys
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from pathlib import Path
from rigidcli.homework.judge import run
from rigidcli.homework.hand_ins import Paper
atexit.register(lambda: print("at the end"))
sys.stdout.write("once ")
print(len(list(run({{}}, [Paper("a", Path({str(tmp_path / "a.yaml")!r}))] * 3))))
"""
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert (ended.stdout, ended.stderr) == ("once 3\nat the end\n", "")


def test_streams_may_be_closed(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(HONEST)
    script = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from pathlib import Path
from rigidcli.homework.judge import run
from rigidcli.homework.judge import Item
from rigidcli.homework.kinds import KINDS
from rigidcli.homework.base import KeySource
from rigidcli.homework.question import Question
from rigidcli.homework.hand_ins import Paper
question = Question.model_validate({{"answer": "1", "kind": "number"}})
items = {{"a": Item(KINDS["number"], KINDS["number"].key(KeySource("a", question, "1")), 1.0)}}
judgements = list(run(items, [Paper("a", Path({str(tmp_path / "a.yaml")!r}))] * 3))
sys.exit(len([j for j in judgements if j.score == 1]))
"""
    for closed in ["<&-", "<&- >&- 2>&-"]:
        command = f'exec "$0" -c "$1" {closed}'
        ended = subprocess.run(["sh", "-c", command, sys.executable, script], check=False)
        assert ended.returncode == 3


def test_an_interrupt_ends_the_processes_and_goes_on(tmp_path: Path) -> None:
    for name in "abcd":
        (tmp_path / f"{name}.yaml").write_text("answers: {q: act}")

    def interrupt(*_: object) -> None:
        if are_at_work(os.getpid()):
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.raise_signal(signal.SIGINT)

    before = signal.signal(signal.SIGALRM, interrupt)
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.05, 0.05)
        with pytest.raises(KeyboardInterrupt):
            list(run({"q": Item(Doing(), {"act": loop}, 1.0)}, handed(tmp_path), 2))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
        signal.signal(signal.SIGINT, handler)


def test_an_interrupt_from_the_keyboard_leaves_quietly(tmp_path: Path) -> None:
    """The whole group of processes gets it, as it does from a terminal."""
    for name in "abcd":
        (tmp_path / f"{name}.yaml").write_text("answers: {q: act}")
    script = f"""
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from pathlib import Path
from rigidcli.homework.judge import run
from rigidcli.homework.judge import Item
from rigidcli.homework.base import ReadAnswer
from rigidcli.homework.hand_ins import Paper
class Loop:
    name = "loop"
    def loaded(self, answer, text_of):
        return answer
    def read(self, key, answer):
        return ReadAnswer(answer, "")
    def judge(self, key, value):
        while True: pass
    def typed(self, key):
        raise ValueError
def told(fraction): pass
try:
    print("begun", flush=True)
    files = [Path({str(tmp_path)!r}) / (name + ".yaml") for name in "abcd"]
    list(run({{"q": Item(Loop(), None, 1.0)}}, [Paper("x", file) for file in files], 2))
except KeyboardInterrupt:
    print("interrupted")
"""
    with subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        end = time.monotonic() + 60
        while not are_at_work(process.pid):
            assert time.monotonic() < end
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=120)
        assert (out, err, process.returncode) == ("interrupted\n", "", 0)
        with pytest.raises(ProcessLookupError):
            os.killpg(process.pid, 0)


def test_rows_that_nobody_asks_for_any_more(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(HONEST)
    (tmp_path / "b.yaml").write_text("answers: {q: act}")
    judgements = run({"q": Item(Doing(), {"act": loop}, 1.0)}, handed(tmp_path), 2)
    next(judgements)
    judgements.close()  # type: ignore[attr-defined]
    assert gc.get_freeze_count() == 0


def turn(task: int) -> bytes:
    """When this work begins and ends."""
    begin = time.monotonic()
    time.sleep(0.05)
    return f"{begin} {time.monotonic()}".encode()


@pytest.mark.parametrize("jobs", [1, 2])
def test_no_more_work_at_a_time_than_is_asked_for(jobs: int) -> None:
    done = list(workers.each(turn, range(6), jobs, SHORT, lambda fraction: None))
    spans = [tuple(map(float, each.decode().split())) for each in done if isinstance(each, bytes)]
    assert len(spans) == 6
    for begin, _ in spans:
        assert sum(other <= begin < end for other, end in spans) <= jobs


def test_processes_end_when_the_one_is_gone_that_started_them() -> None:
    script = f"""
import sys, time
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from rigidcli.homework import workers
from rigidcli.sandbox import Limits
list(workers.each(lambda task: time.sleep(1.5) or b"", range(4), 2, Limits(), lambda fraction: None))
"""
    with subprocess.Popen([sys.executable, "-c", script], start_new_session=True) as process:
        end = time.monotonic() + 60
        while len(children(process.pid)) < 2:
            assert time.monotonic() < end
            time.sleep(0.01)
        process.kill()
        process.wait()
        while True:
            try:
                os.killpg(process.pid, 0)
            except ProcessLookupError:
                break
            assert time.monotonic() < end
            time.sleep(0.01)


def descriptors() -> list[str]:
    return sorted(entry.name for entry in Path("/proc/self/fd").iterdir())


def test_no_descriptor_is_left_open(tmp_path: Path) -> None:
    for name in "abc":
        (tmp_path / f"{name}.yaml").write_text(HONEST)
    rows = handed(tmp_path)
    list(run(ITEMS, rows))
    before = descriptors()
    for _ in range(5):
        list(run(ITEMS, rows))
    assert descriptors() == before


def test_no_room_for_a_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, started: Callable[[], list[str]]
) -> None:
    (tmp_path / "a.yaml").write_text(HONEST)
    fork, room = os.fork, 2

    def full() -> int:
        if len(started()) >= room:
            raise BlockingIOError(11, "Resource temporarily unavailable")
        return fork()

    monkeypatch.setattr(os, "fork", full)
    rows = [Paper("a", tmp_path / "a.yaml")] * 30
    assert all(verdicts(each) == ["correct", "correct"] for each in run(ITEMS, rows, 6))
    room = 0
    with pytest.raises(ComputationError, match="no process can be started: Resource temporarily"):
        list(run(ITEMS, rows, 6))


KEYS = """
number: {answer: 20.8}
quantity: {answer: 20.8 rad/s}
vector: {answer: [1, 2, 3]}
moments: {answer: [2, 11, 11]}
matrix: {answer: [[1, 2], [3, 4]]}
tensor: {answer: [[8, -3, -3], [-3, 8, -3], [-3, -3, 8]]}
axes: {answer: {tensor: [[1, 0, 0], [0, 2, 0], [0, 0, 2.5]]}}
expression: {answer: m*x**2/2, symbols: {m: positive, x: real}}
equations: {answer: {xdot: p_x/m, p_xdot: -k*x}, symbols: {m: positive, k: positive}, coordinates: [x]}
trajectory: {answer: {t: [0, 1, 0.1], columns: {x: cos(t)}}}
choice: {answer: prolate}
"""


def real_items() -> dict[str, Item]:
    """A question of every kind; conserved quantities follow from a document."""
    questions = dict(line.split(": {", 1) for line in KEYS.strip().splitlines())
    free = "system: {coordinates: [x, y], kinetic: xdot^2 + ydot^2, potential: (x^2 + y^2)^2}"
    items = {kind: asked(f"{{kind: {kind}, {question}") for kind, question in questions.items()}
    items["invariants"] = asked("{ask: hamilton.invariants}", free)
    assert items.keys() == KINDS.keys()
    return items


BOMBS = [
    "9**9**9**9", "(" * 5000 + "1" + ")" * 5000, "-" * 5000 + "1", "2**" * 5000 + "1",
    "sin(" * 2000 + "1" + ")" * 2000, "1e999999999", "1e-999999999", "9" * 400, "9" * 5000,
    "." + "0" * 5000 + "1", "x**x**x**x**x", "(x+1)**99999999", "exp(exp(exp(exp(9))))",
    "__import__('os').system('touch hacked')", "().__class__.__bases__[0].__subclasses__()", "lambda: 0",
    "=cmd|' /C calc'!A0", "\x1b[31m", "\u202e1\u202c", "NaN", ".inf", "-Infinity", "0x41", "1_000", "1/0",
    "0**-1", "/etc/passwd", "\N{ARABIC-INDIC DIGIT ONE}",
]  # fmt: skip


@pytest.mark.parametrize("form", ["text", "list", "rows", "mapping"])
def test_bombs_for_every_kind(tmp_path: Path, form: str) -> None:
    items = real_items()
    forms: dict[str, Callable[[str], Tree]] = {
        "text": lambda bomb: bomb,
        "list": lambda bomb: [bomb] * 3,
        "rows": lambda bomb: [[bomb] * 3] * 3,
        "mapping": lambda bomb: {"file": bomb} if bomb.startswith("/") else {bomb: bomb, "xdot": bomb},
    }
    for k, bomb in enumerate(BOMBS):
        answers = dict.fromkeys(items, forms[form](bomb))
        (tmp_path / f"{k:02}.json").write_text(json.dumps({"answers": answers}))
    before = snapshot(tmp_path)
    for judgement in run(items, handed(tmp_path)):
        assert set(verdicts(judgement)) <= {"incorrect", "invalid", "review", "partial"}, judgement
        assert "timeout" not in codes(judgement), judgement
    assert snapshot(tmp_path) == before


def test_the_keys_of_every_kind_are_right_through_a_pipe(tmp_path: Path) -> None:
    items = real_items()
    answers = {id: item.kind.typed(item.key) for id, item in items.items()}
    (tmp_path / "a.json").write_text(json.dumps({"answers": answers}))
    (judgement,) = run(items, handed(tmp_path))
    assert verdicts(judgement) == ["correct"] * len(items)


def test_processes_that_start_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on systems on which forks are not safe: the same judgements of the same files."""
    items = {id: item for id, item in real_items().items() if id in ("number", "choice")}
    (tmp_path / "a.yaml").write_text("answers: {number: 20.8, choice: oblate}")
    (tmp_path / "b.yaml").write_text("[" * 1000)
    (tmp_path / "c.yaml").symlink_to("a.yaml")
    forked = list(run(items, handed(tmp_path)))
    monkeypatch.setattr(workers, "START_METHOD", "spawn")
    assert list(run(items, handed(tmp_path), 3)) == forked
