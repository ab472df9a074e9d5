# The RTL's files and named configurations, for the scripts here and in ../syn. Source it.
#
#   rtl_files UNIT            sets RTL_FILES to the files of a unit, each after those it uses
#   RTL_HEAP                  those of the heap unit
#   heap_configs              prints the names of the heap's configurations
#   heap_config NAME KEY      prints one value of configs.toml

RTL_DIR=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

rtl_files() {
    RTL_FILES=()
    local file
    while read -r file; do
        RTL_FILES+=("$RTL_DIR/$file")
    done < <(sed -n '/xy_.*\.sv$/p' "$RTL_DIR/$1.f")
}

rtl_files heap
RTL_HEAP=("${RTL_FILES[@]}")

heap_configs() {
    sed -n 's/^\[heap\.\(.*\)\]$/\1/p' "$RTL_DIR/configs.toml"
}

heap_config() {
    awk -v section="[heap.$1]" -v key="$2" '
        /^\[/ { inside = ($0 == section) }
        inside && $1 == key && $2 == "=" { print $3; found = 1 }
        END { exit !found }
    ' "$RTL_DIR/configs.toml" || {
        echo "configs.toml: [heap.$1] has no $2" >&2
        return 1
    }
}
