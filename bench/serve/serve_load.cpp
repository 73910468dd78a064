// SPDX-License-Identifier: MIT
// serve_load: puts one of three loads on a daemon that runs on loopback and prints what it measured as JSON.
// bench/serve/run starts daemons and calls it.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "bench/serve/loads.h"

int main(int argc, char** argv) try {
  using namespace pmcd::bench;
  CLI::App app{"serve_load: loads for a pmcd on loopback"};
  app.require_subcommand(1);

  FetchOptions fetch;
  CLI::App* sub = app.add_subcommand("fetch", "Sessions that always have a request open");
  sub->add_option("--port", fetch.port, "Request port")->required();
  sub->add_option("--mesh", fetch.meshes, "Mesh names, dealt out to the sessions in turn")->required();
  sub->add_option("--bytes", fetch.packet_bytes, "Size of every packet")->required();
  sub->add_option("--sessions", fetch.sessions, "Sessions")->capture_default_str();
  sub->add_option("--open", fetch.open, "Requests that each keeps open")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  sub->add_option("--seconds", fetch.seconds, "How long")->capture_default_str();
  sub->callback([&fetch] { std::cout << fetch_load(fetch) << std::endl; });

  SetupOptions setup;
  sub = app.add_subcommand("setup", "Sessions that come and go");
  sub->add_option("--port", setup.port, "Request port")->required();
  sub->add_option("--at-once", setup.at_once, "Sessions at a time")->capture_default_str();
  sub->add_option("--seconds", setup.seconds, "How long")->capture_default_str();
  sub->callback([&setup] { std::cout << setup_load(setup) << std::endl; });

  HoldOptions hold;
  sub = app.add_subcommand("hold", "Sessions that stand and do nothing");
  sub->add_option("--port", hold.port, "Request port")->required();
  sub->add_option("--sessions", hold.sessions, "Sessions")->required();
  sub->add_option("--mesh", hold.mesh, "Mesh that some open")->required();
  sub->add_option("--opened", hold.opened, "How many of them")->capture_default_str();
  sub->callback([&hold] { hold_load(hold); });

  CLI11_PARSE(app, argc, argv);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "serve_load: " << error.what() << '\n';
  return 1;
}
