#!/usr/bin/env bash
# Installs the package as a user would, into a fresh virtual environment, and tests it there.
# What is said goes to pytest: `python/test.sh -k progress`.
set -euo pipefail
cd "$(dirname "$0")/.."

if ! python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
    echo "the tests' packages are pinned for Python 3.11 and newer, but python3 is $(python3 --version)" >&2
    exit 1
fi

# Beside what Cargo built, which the wheel takes.
environment="${CARGO_TARGET_DIR:-target}/python"
python3 -m venv --clear "$environment"
bin="$environment/bin"
"$bin/pip" install --quiet --disable-pip-version-check --require-hashes --requirement python/requirements-test.txt
"$bin/ruff" check .
"$bin/ruff" format --check .
"$bin/mypy"
"$bin/pip" install --quiet --disable-pip-version-check --no-deps .
"$bin/python" -m pytest "$@"
