# Shell functions that server/run and tests/run share. Sourced from the repository's root.
# shellcheck shell=sh

say() { echo "== $*" >&2; }

# build DIR TARGET...: prints the number of steps and seconds; the first build takes many minutes.
build() {
  say "Building $*; the steps are counted, and only the first time are they many"
  build_dir=$1
  shift
  NINJA_STATUS='[%p, step %f of %t, %e s] ' cmake --build "$build_dir" --target "$@" >&2
}

# Installs the compiler, the libraries and, for the page, Node, unless a recent one is installed.
install_build_packages() {
  docker/install-packages build "$@"
  if ! node_is_new_enough; then
    docker/install-packages node
    node_is_new_enough || {
      echo "node 18.13 or newer and npm are needed to build the page" >&2
      exit 1
    }
  fi
}

node_is_new_enough() {
  command -v npm >/dev/null && command -v node >/dev/null &&
    node -e 'const [a, b] = process.versions.node.split(".").map(Number);
      process.exit(a > 18 || (a === 18 && b >= 13) ? 0 : 1)'
}

# configure DIR [cmake arguments]: only if DIR is new, was configured elsewhere, or arguments are
# given.
configure() {
  build_dir=$1
  shift
  if [ -f "$build_dir/CMakeCache.txt" ] &&
    ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$PWD" "$build_dir/CMakeCache.txt"; then
    rm -rf "$build_dir/CMakeCache.txt" "$build_dir/CMakeFiles"
  fi
  if [ ! -f "$build_dir/build.ninja" ] || [ ! -f "$build_dir/CMakeCache.txt" ] || [ $# -gt 0 ]; then
    say "Configuring $build_dir"
    cmake -S . -B "$build_dir" -G Ninja -DCMAKE_BUILD_TYPE=Release "$@" >&2
  fi
}
