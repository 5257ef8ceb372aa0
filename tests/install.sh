# `install PACKAGE...`: what is missing, from the Debian or Ubuntu archive; as root, or by sudo. To be sourced.

install() {
    local root=() name=${0#"$PWD"/}
    if [[ $EUID -ne 0 ]]; then
        if ! command -v sudo >/dev/null; then
            echo "$name: $* should be installed, but there is neither root nor sudo to do so" >&2
            return 1
        fi
        root=(sudo)
    fi
    if ! command -v apt-get >/dev/null; then
        echo "$name: $* should be installed, but there is no apt-get to do so" >&2
        return 1
    fi
    echo "$name: installing $*" >&2
    "${root[@]}" apt-get update -q
    DEBIAN_FRONTEND=noninteractive "${root[@]}" apt-get install -q -y --no-install-recommends "$@"
}
