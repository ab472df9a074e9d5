# The RTL's files and named configurations, for the scripts here and in ../syn. Source it.
#
#   RTL_HEAP                  files of the heap unit, each after those it uses
#   heap_configs              prints the names of the heap's configurations
#   heap_config NAME KEY      prints one value of configs.toml

RTL_DIR=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

RTL_HEAP=()
while read -r file; do
    RTL_HEAP+=("$RTL_DIR/$file")
done < <(sed -n '/^xy_/p' "$RTL_DIR/heap.f")

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
