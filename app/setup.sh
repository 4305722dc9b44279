# Sourced by app/run and tests/run: set up what is missing, and only that. Needs Python 3.11 or later.
# Wants $root, the folder of the project. Everything it says goes to standard error.

say() { printf '%s\n' "fluidwarp: $*" >&2; }

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"; elif command -v sudo >/dev/null 2>&1; then sudo "$@"; else return 1; fi
}

# Install the Debian or Ubuntu packages that are missing.
need_packages() {
    command -v dpkg-query >/dev/null 2>&1 || return 0
    missing=
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing="$missing $package"
    done
    [ -n "$missing" ] || return 0
    say "installing$missing"
    # shellcheck disable=SC2086  # a list of names
    if ! { as_root apt-get update -qq && as_root env DEBIAN_FRONTEND=noninteractive \
           apt-get install -y -qq --no-install-recommends $missing; } >&2; then
        say "could not install$missing; ask an administrator to: apt-get install$missing"
    fi
}

# A virtual environment in .venv that holds the project, with the extra $1 if one is named.
need_environment() {
    # First the system's own, and first what can make environments as it is: distributions build theirs with
    # profile-guided optimisation, which what pyenv compiles by default lacks; the program starts a quarter quicker.
    python=
    for needed in ", ensurepip" ""; do
        for candidate in "${PYTHON:-/usr/bin/python3}" python3 python3.14 python3.13 python3.12 python3.11; do
            [ -z "$python" ] || break
            if "$candidate" -c "import sys$needed; sys.exit(sys.version_info < (3, 11))" 2>/dev/null; then
                python=$candidate
            fi
        done
    done
    [ -n "$python" ] || { say "Python 3.11 or later is needed and none was found"; exit 1; }
    if ! [ -x "$root/.venv/bin/pip" ]; then
        # Debian's Python lacks ensurepip until python3-venv is installed.
        "$python" -c 'import ensurepip' 2>/dev/null || need_packages python3-venv
        "$python" -m venv "$root/.venv" >&2 || { say "could not make the virtual environment $root/.venv"; exit 1; }
    fi
    wanted="$1 $(cat "$root/pyproject.toml" "$root/app/constraints.txt" | cksum)"
    if [ "$(cat "$root/.venv/fluidwarp-$1" 2>/dev/null)" != "$wanted" ]; then
        say "installing Python packages into $root/.venv"
        "$root/.venv/bin/pip" install -q --disable-pip-version-check -c "$root/app/constraints.txt" \
            -e "$root${1:+[$1]}" >&2
        printf '%s' "$wanted" > "$root/.venv/fluidwarp-$1"
    fi
}

# A GL driver that renders without a GPU, the loaders, and the X libraries that the window's toolkit links to.
need_opengl() { need_packages libegl1 libgl1 libgl1-mesa-dri libx11-6 libxext6; }
