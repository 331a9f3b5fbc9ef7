# Shared by the scripts: steps with times, packages, the environment of a build. Source it.
set -Eeuo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export PATH=/usr/bin:$PATH  # ROS belongs to the system's Python, whatever other comes first
export ROS_HOSTNAME=${ROS_HOSTNAME:-localhost}

# step "what it does" command...: runs the command, says what and how long. A failing command ends the script.
step() {
  current_step=$1
  local start=$SECONDS
  shift
  echo "==> $current_step"
  "$@"
  echo "    done in $((SECONDS - start)) s"
  current_step=
}
current_step=
trap 'if [ -n "$current_step" ]; then echo "FAILED: $current_step" >&2; fi' ERR

# What a script leaves out on this system: said at once and again by what_was_skipped, at the end.
skipped=()
skip() {
  skipped+=("$1")
  echo "    SKIPPED: $1" >&2
}
what_was_skipped() {
  local each
  for each in "${skipped[@]}"; do echo "SKIPPED: $each" >&2; done
}

# apt-get as root, without questions.
apt_get() {
  local sudo=
  if [ "$(id -u)" -ne 0 ]; then sudo=sudo; fi
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get -qq "$@"
}

# Installs with apt what is missing.
install_dependencies() {
  local list=$root/scripts/dependencies.debian.txt beside= missing=() package
  if [ -d /opt/ros/noetic ]; then list=$root/scripts/dependencies.noetic.txt; fi
  # Debian 13's rviz shows its icons only with this package, on which it does not depend.
  if grep -q '^VERSION_CODENAME=trixie' /etc/os-release; then beside=qt6-svg-plugins; fi
  for package in $(grep -v '^#' "$list") $beside; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
  done
  if [ ${#missing[@]} -eq 0 ]; then
    echo "    nothing is missing"
    return
  fi
  echo "    installing ${#missing[@]} packages"
  apt_get update
  apt_get install -y --no-install-recommends "${missing[@]}" >/dev/null
}

# ROS of the system, where it is not in the standard places.
source_system_ros() {
  if [ -f /opt/ros/noetic/setup.bash ]; then
    set +u
    source /opt/ros/noetic/setup.bash
    set -u
  fi
}

# Says at each tenth how far a build is, whose output it reads. No awk: mawk holds back for minutes what it reads.
say_progress() {
  local line next=10
  while read -r line; do
    if [[ $line =~ ^\[\ *([0-9]+)% ]] && [ "${BASH_REMATCH[1]}" -ge "$next" ]; then
      echo "    ${BASH_REMATCH[1]} %"
      next=$((BASH_REMATCH[1] / 10 * 10 + 10))
    fi
  done
}

# Configures a build; a new one is for Ninja, which keeps all cores busy. $1: build folder; then arguments of cmake.
configure_build() {
  local folder=$1 generator=()
  shift
  if [ ! -f "$folder/CMakeCache.txt" ]; then generator=(-G Ninja); fi
  cmake -S "$root" -B "$folder" "${generator[@]}" "$@"
}

# Builds and says how far it is. $1: build folder; then targets, or none for all.
build_targets() {
  local folder=$1 targets=()
  shift
  if [ $# -gt 0 ]; then
    cmake "$folder" -DBKI_MAPPING_CHOSEN="$(IFS=';' && echo "$*")" >/dev/null
    targets=(--target bki_mapping_chosen)
  fi
  NINJA_STATUS='[%p] ' cmake --build "$folder" -j"$(nproc)" "${targets[@]}" 2>&1 | tee "$folder/build.log" | say_progress ||
    { grep -E -A 12 '(error|warning):' "$folder/build.log" | head -60; tail -20 "$folder/build.log"; return 1; } >&2
}

# The packages of a build tree. $1: build folder.
source_build() {
  set +u
  source "$1/devel/setup.bash"
  set -u
}

# ctest with the arguments after the first. $1: build folder; before CMake 3.20 ctest itself takes none.
run_ctest() {
  (cd "$1" && ctest --no-tests=error --output-on-failure "${@:2}")
}

# A program of the package with a ROS master of its own, so that its exit status counts. $1: build folder, $2: program.
run_with_master() {
  (
    source_build "$1"
    export ROS_MASTER_URI=http://localhost:${BKI_MAPPING_MASTER_PORT:-11611}
    roscore -p "${ROS_MASTER_URI##*:}" >/dev/null 2>&1 &
    trap 'kill %1 %2 2>/dev/null; wait' EXIT
    for _ in $(seq 100); do
      if rosparam list >/dev/null 2>&1; then break; fi
      sleep 0.1
    done
    # The scheduler groups sessions: in that of other tests, threads that publish (nice 19) may wait for minutes.
    setsid "$1/devel/lib/bki_mapping/$2" &
    wait %2
  )
}

# $1: build folder, $2: seconds, $3: seed of the faults.
run_soak() {
  BKI_MAPPING_SOAK_SECONDS=$2 BKI_MAPPING_SOAK_SEED=$3 run_with_master "$1" soak_test
}

# The hostile publisher, set by BKI_MAPPING_HOSTILE_*. It says its counts; where it fails, also what failed, and the last
# messages that were sent. $1: build folder.
run_hostile() {
  local folder failed=false
  folder=$(mktemp -d)
  UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 ASAN_OPTIONS=quarantine_size_mb=64 \
    BKI_MAPPING_HOSTILE_JOURNAL=$folder/journal run_with_master "$1" hostile_test >"$folder/log" 2>&1 || failed=true
  grep -a '^\[hostile\]' "$folder/log" || true
  if $failed; then
    grep -a -A 8 -E ': Failure$|ERROR: AddressSanitizer|runtime error|terminate called' "$folder/log" | head -n 200
    echo "The last messages sent, the last of them last:"
    tail -n 5 "$folder/journal"
    echo "All of the log: $folder/log"
    return 1
  fi >&2
  rm -rf "$folder"
}

# A build for a sanitizer. $1: build folder, $2: sanitizer, $3: debug flags, $4: more flags for the ROS shell. Checks of each
# pointer double the time of compiling, so they are left to scripts/fuzz --target; the address sanitizer sees most wrong pointers
# when they are used.
configure_sanitizer() {
  configure_build "$1" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG="$3" \
    -DCMAKE_CXX_FLAGS="-O1 -fsanitize=$2 -fno-sanitize=null,alignment,object-size,pointer-overflow,vptr -fno-omit-frame-pointer" \
    -DBKI_MAPPING_SHELL_FLAGS="${4-}" -DBKI_MAPPING_JOIN=ON -DBKI_MAPPING_LIGHT=ON >/dev/null
}
