// SPDX-License-Identifier: MIT
// rules_client: fetches one mesh as one client of bench/rules/run does, and prints when each packet was there as one
// line of JSON.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "bench/rules/fetch_client.h"

int main(int argc, char** argv) try {
  pmcd::bench::ClientOptions options;
  CLI::App app{"rules_client: fetches one mesh and says when each packet was there"};
  app.add_option("--address", options.address, "IPv4 address of the daemon")->required();
  app.add_option("--port", options.port, "Its request port")->required();
  app.add_option("--mesh", options.mesh, "Name of the mesh")->required();
  app.add_option("--open", options.open, "Requests to keep open")->check(CLI::Range(1, 8))->capture_default_str();
  app.add_option("--start-at", options.start_at, "Seconds of CLOCK_MONOTONIC at which to connect; without it now");
  app.add_option("--delay-start", options.delay_start, "Seconds to wait after that")->check(CLI::NonNegativeNumber);
  CLI::Option* const stall = app.add_option("--stall-after-packet", options.stall_after,
                                            "Take nothing more behind this packet, and stay until dropped");
  app.add_option("--leave-after-packet", options.leave_after, "Close the session behind this packet")->excludes(stall);
  CLI11_PARSE(app, argc, argv);
  std::cout << pmcd::bench::fetch_mesh(options) << std::endl;
  return 0;
} catch (const std::exception& error) {
  std::cerr << "rules_client: " << error.what() << '\n';
  return 1;
}
