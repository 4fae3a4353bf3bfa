# Sourced by ./run and ./test: installs the Debian packages that are missing, and builds.

# install FILE...: the packages that the files list, one a line.
install() {
  local missing=() package
  for package in $(cat "$@"); do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  local root=()
  [ "$(id -u)" = 0 ] || root=(sudo)
  echo "Installing Debian packages: ${missing[*]}" >&2
  "${root[@]}" apt-get update -qq >&2
  DEBIAN_FRONTEND=noninteractive "${root[@]}" apt-get install -qq -y --no-install-recommends "${missing[@]}" >&2
}

# build TARGET...: a Release build in build/; a second one rebuilds only what changed.
build() {
  cmake -G Ninja -S . -B build -DCMAKE_BUILD_TYPE=Release >/dev/null
  ninja -C build --quiet "$@" >&2
}
