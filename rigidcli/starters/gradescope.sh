#!/bin/sh
# An autograder for Gradescope: a "Programming Assignment" there judges each hand-in with `rigidcli check`.
#
# 1. In a folder with the assignment (here homework.yaml) and the documents that it names, run
#        rigidcli new gradescope | sh
#    which writes setup.sh, requirements.txt and run_autograder.
# 2. zip -r autograder.zip .
# 3. Upload autograder.zip in Gradescope: Configure Autograder, with Ubuntu 22.04 or later.
set -eu

# The version with which the keys were tried; `rigidcli --version` tells it.
cat > requirements.txt <<'END'
rigidcli
END

# Gradescope runs this once, as root, in /autograder/source, when the autograder is built.
cat > setup.sh <<'END'
#!/usr/bin/env bash
set -euo pipefail
cd "$(dirname "$0")"
usable() { "$1" -c 'import ensurepip, sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }
for python in python3 python3.13 python3.12 python3.11; do usable "$python" && break; done
if ! usable "$python"; then # Ubuntu 22.04 comes with Python 3.10
    apt-get update && apt-get install -y python3.11 python3.11-venv
fi
"$python" -m venv ../venv
../venv/bin/pip install -r requirements.txt
END

# And this for each hand-in, in /autograder, with what is handed in below submission/.
cat > run_autograder <<'END'
#!/usr/bin/env bash
set -uo pipefail
cd "$(dirname "$0")"
mkdir -p results
venv/bin/rigidcli check source/homework.yaml submission -f gradescope -o results/results.json
code=$?
[ "$code" -eq 1 ] || exit "$code" # 1: an answer is not correct, which is no failure of the autograder
END

chmod +x setup.sh run_autograder
