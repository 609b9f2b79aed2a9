#!/usr/bin/env bash
# Installs the package as a user would, into a fresh virtual environment, and tests it there.
# What is said goes to pytest: `python/test.sh -k progress`.
set -euo pipefail
cd "$(dirname "$0")/.."

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
