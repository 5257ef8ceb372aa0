# What tests need of the system, to be sourced: `install PACKAGE...` takes it from the Debian or Ubuntu archive, as root or by
# sudo; `has_driver` and `has_browser` say whether it is there.

install() {
    local root=() name=${0#"$PWD"/}
    if [[ $EUID -ne 0 ]]; then
        if ! command -v sudo >/dev/null; then
            echo "$name: $* should be installed, but there is neither root nor sudo to do so" >&2
            return 1
        fi
        # As such, with its environment: sudo takes none along.
        root=(sudo env DEBIAN_FRONTEND=noninteractive)
    fi
    if ! command -v apt-get >/dev/null; then
        echo "$name: $* should be installed, but there is no apt-get to do so" >&2
        return 1
    fi
    echo "$name: installing $*" >&2
    "${root[@]}" apt-get update -q
    DEBIAN_FRONTEND=noninteractive "${root[@]}" apt-get install -q -y --no-install-recommends "$@"
}

# Whether a Vulkan driver and its loader are there. (A driver for hardware that is not there does not count as
# one, but whether it works only shows when it is opened: the tests tell.)
has_driver() {
    local folder driver
    # The loader is opened by name; the linker's cache lists it.
    [[ "$(PATH="$PATH:/sbin" ldconfig -p)" == *libvulkan.so.1* ]] || return 1
    [[ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ]] && return 0
    for folder in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d; do
        for driver in "$folder"/lvp_icd*.json "$folder"/nvidia_icd*.json; do
            [[ -e "$driver" ]] && return 0
        done
    done
    return 1
}

# Whether a browser is there that can be driven without a window.
has_browser() {
    command -v chromium || command -v chromium-browser || command -v google-chrome
} >/dev/null
