#!/bin/sh
# fetch_monocypher.sh FOLDER [PYTHON]: puts Monocypher (monocypher.c, monocypher.h, its licence) there.
#
# The C file is in the source distribution of PyPI's pymonocypher. pip downloads it and checks the hash of
# tools/monocypher.lock; nothing of the package is installed. pip needs its build tools to name the
# package: about 4 MB more, in a folder that it removes.
set -eu

target=$1
python=${2:-python3}
tools=$(dirname -- "$(readlink -f -- "$0")")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT INT TERM

if ! "$python" -m pip download --quiet --disable-pip-version-check --no-deps --no-binary pymonocypher \
    --require-hashes --requirement "$tools/monocypher.lock" --dest "$work" >"$work/log" 2>&1; then
    tail -n 3 "$work/log" >&2
    echo "error: fetch_monocypher.sh: pip could not download pymonocypher" >&2
    exit 1
fi
mkdir "$work/tree"
tar -xf "$work"/pymonocypher-*.tar.gz -C "$work/tree" --strip-components=1 --wildcards \
    '*/monocypher.c' '*/monocypher.h' '*/LICENSE.txt'
mkdir -p "$(dirname "$target")"
rm -rf "$target"
mv "$work/tree" "$target"
