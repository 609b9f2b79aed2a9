#!/usr/bin/env bash
# Renders the pictures of docs/GALLERY.md by the commands that stand there. With words, only those commands that hold one of them.
set -euo pipefail
cd "$(dirname "$0")/.."

sed -n '/^```sh$/,/^```$/{/^```/d;p}' docs/GALLERY.md | while IFS= read -r command; do
    if [ $# = 0 ] || grep -qE "$(IFS='|'; echo "$*")" <<<"$command"; then
        echo "$command"
        bash -c "$command" </dev/null
    fi
done
