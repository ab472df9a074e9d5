# Installs and locates the external tools. Source it; every function is quick when its tool is there.
#
#   need_apt PACKAGE...    Debian packages, installed with apt-get when this user may
#   need_pip PACKAGE...    Python packages, into target/tools/venv, whose bin/ goes on PATH
#
# Both fail with a message that says what to install by hand where they cannot.

XYLEM_ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
XYLEM_TOOLS=$XYLEM_ROOT/target/tools
export PATH="$XYLEM_TOOLS/venv/bin:$PATH"

need_apt() {
    local missing=()
    local package
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return 0
    local sudo=
    [ "$(id -u)" -eq 0 ] || sudo="sudo -n"
    if ! command -v apt-get >/dev/null || { [ -n "$sudo" ] && ! sudo -n true 2>/dev/null; }; then
        echo "tools: install these by hand: ${missing[*]}" >&2
        return 1
    fi
    echo "tools: installing ${missing[*]}" >&2
    $sudo apt-get update -qq >/dev/null &&
        DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends \
            "${missing[@]}" >/dev/null
}

need_pip() {
    mkdir -p "$XYLEM_TOOLS"
    [ -x "$XYLEM_TOOLS/venv/bin/python" ] || python3 -m venv "$XYLEM_TOOLS/venv" || return 1
    local stamp missing=()
    local package
    for package in "$@"; do
        stamp=$XYLEM_TOOLS/venv/.have-${package//[^a-zA-Z0-9]/_}
        [ -e "$stamp" ] || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return 0
    echo "tools: installing ${missing[*]} into $XYLEM_TOOLS/venv" >&2
    "$XYLEM_TOOLS/venv/bin/pip" install --quiet --disable-pip-version-check "${missing[@]}" || return 1
    for package in "${missing[@]}"; do
        touch "$XYLEM_TOOLS/venv/.have-${package//[^a-zA-Z0-9]/_}"
    done
}
