"""Linear equations between trees, solved by elimination as steps of code: a x = b without pivots.

The factors are those of L D L^T, as a symmetric and positive definite matrix has them: a mass matrix is that.
"""

from __future__ import annotations

from collections.abc import Sequence

from rigidcli.language.tree import ONE, ZERO, Name, Node

Step = tuple[str, Node]
"""A name, and its value from names before."""


def solved(matrix: Sequence[Sequence[Node]], right: Sequence[Node]) -> tuple[list[Step], list[Node]]:
    """Steps, and then x: of a symmetric matrix (n by n) and b (n), for `code.function`.

    With zeros in the matrix there are fewer steps. Names of steps begin with a dot, as no name of
    a document does.
    """
    size = len(matrix)
    steps: list[Step] = []

    def named(kind: str, value: Node) -> Node:
        if value in (ZERO, ONE) or isinstance(value, Name):
            return value
        steps.append((f".{kind}{len(steps)}", value))
        return Name(steps[-1][0])

    # Zero has one tree from here on, however it is written.
    rows = [[ZERO if getattr(entry, "value", None) == 0 else entry for entry in row] for row in matrix]
    factors: list[list[Node]] = [[ZERO] * size for _ in rows]
    pivots: list[Node] = []
    for j in range(size):
        # D_j = A_jj - sum_k L_jk^2 D_k,  L_ij = (A_ij - sum_k L_ik L_jk D_k)/D_j
        carried = [factors[j][k] * pivots[k] for k in range(j)]
        pivots.append(named("d", sum((-factors[j][k] * carried[k] for k in range(j)), rows[j][j])))
        for i in range(j + 1, size):
            entry = sum((-factors[i][k] * carried[k] for k in range(j)), rows[i][j])
            factors[i][j] = named("l", entry / pivots[j])
    ahead: list[Node] = []
    for i in range(size):
        ahead.append(named("y", sum((-factors[i][k] * ahead[k] for k in range(i)), right[i])))
    answers: list[Node] = [ZERO] * size
    for i in reversed(range(size)):
        own = ahead[i] / pivots[i]
        answers[i] = named("x", sum((-factors[k][i] * answers[k] for k in range(i + 1, size)), own))
    return steps, answers
