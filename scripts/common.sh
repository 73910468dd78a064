# SPDX-License-Identifier: MIT
# What the scripts in this folder share: messages, root rights, the number of jobs. Sourced, not run.
# shellcheck shell=bash

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# say TEXT...: a step, so that a reader of the log sees where the time goes.
say() {
  printf '\n== [%4ds] %s\n' "$SECONDS" "$*"
}

# fail TEXT...: says what is wrong on stderr and ends the script with exit code 1.
fail() {
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

# as_root COMMAND...: runs it with root rights, through sudo if need be.
as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    fail "needs root rights for: $* (run as root, or install sudo)"
  fi
}

# configure PRESET [CMAKE OPTION...]: makes build/PRESET ready.
configure() {
  (cd "$repository" && cmake --preset "$@")
}

# build PRESET JOBS [TARGET...]: builds these targets, or everything.
build() {
  local preset=$1 jobs=$2
  shift 2
  (cd "$repository" && cmake --build --preset "$preset" --parallel "$jobs" ${1:+--target "$@"})
}
