#!/bin/sh
# fetch_unity.sh FOLDER: puts the Unity test framework (unity.c, unity.h, unity_internals.h) there.
#
# Debian ships Unity inside the source package ntpsec (tests/unity). The package is downloaded with
# a source list of our own, derived from the machine's, so the system's lists stay as they are. apt
# checks the archive's signature; the tarball is checked once more against the .dsc.
set -eu

target=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT INT TERM
# apt drops its rights while it downloads and must be able to write there.
chmod 755 "$work"

keyring=/usr/share/keyrings/debian-archive-keyring.gpg
signed=
[ ! -e "$keyring" ] || signed="[signed-by=$keyring] "

apt_here() {
    apt-get -qq -o Dir::Etc::sourcelist="$work/sources.list" -o Dir::Etc::sourceparts=- \
        -o Dir::State::lists="$work/lists" -o Dir::Cache::pkgcache= -o Dir::Cache::srcpkgcache= \
        -o APT::Sandbox::User= "$@"
}

fetch() {
    printf 'deb-src %s%s\n' "$signed" "$1" >"$work/sources.list"
    rm -rf "$work/lists" "$work/source"
    mkdir -p "$work/lists/partial" "$work/source"
    apt_here update >"$work/log" 2>&1 &&
        (cd "$work/source" && apt_here source --download-only ntpsec >>"$work/log" 2>&1)
}

# The release itself first: its pool always holds what its index names.
# shellcheck disable=SC2016 # apt-get fills these in, not the shell
apt-get indextargets --format '$(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' |
    grep ' main$' | sort -u >"$work/all"
grep -v -e '-security ' -e '-updates ' "$work/all" >"$work/candidates" || true
grep -e '-security ' -e '-updates ' "$work/all" >>"$work/candidates" || true

found=
while read -r source; do
    if fetch "$source"; then
        found=yes
        break
    fi
done <"$work/candidates"
if [ -z "$found" ]; then
    tail -n 3 "$work/log" >&2 2>/dev/null || true
    echo "error: fetch_unity.sh: no package source of this machine offers ntpsec's source" >&2
    exit 1
fi

cd "$work/source"
set -- ntpsec_*.orig.tar.*z
tarball=$1
# Under "Checksums-Sha256:" each line is: hash, size, name.
wanted=$(sed -n '/^Checksums-Sha256:/,/^[^ ]*:$/s/^ \([0-9a-f]\{64\}\) .* '"$tarball"'$/\1/p' ntpsec_*.dsc)
actual=$(sha256sum "$tarball" | cut -d ' ' -f 1)
if [ -z "$wanted" ] || [ "$wanted" != "$actual" ]; then
    echo "error: fetch_unity.sh: $tarball: SHA-256 $actual is not the ${wanted:-(absent)} of the .dsc" >&2
    exit 1
fi

mkdir "$work/tree"
tar -xf "$tarball" -C "$work/tree" --strip-components=1 --wildcards '*/tests/unity/unity*'
rm -rf "$target"
mkdir -p "$(dirname "$target")"
mv "$work/tree/tests/unity" "$target"
