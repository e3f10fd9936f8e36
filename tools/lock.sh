#!/bin/sh
# Makes every requirements*.lock from the .txt beside it: the SHA-256 of every file, for pip
# --require-hashes. Needs uv and the package index. All lists constrain one another: one version each.
set -eu

cd -- "$(dirname -- "$(readlink -f -- "$0")")"
constraints=
for list in requirements*.txt; do
    constraints="$constraints -c $list"
done
for list in requirements*.txt; do
    lock=${list%.txt}.lock
    {
        printf '# %s with the SHA-256 of every file, for pip --require-hashes. Made by tools/lock.sh.\n' "$list"
        # shellcheck disable=SC2086 # a list of words
        uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-annotate \
            --no-header $constraints "$list"
    } >"$lock.new"
    mv "$lock.new" "$lock"
done
