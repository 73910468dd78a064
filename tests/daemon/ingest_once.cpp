// SPDX-License-Identifier: MIT
// Usage: ingest_once SOCKET NAME SEED. Ingests the fake mesh of that seed; exit 0 only when the daemon confirmed it.
// A process of its own, so that a test can kill it.
#include <cstdlib>
#include <string>

#include "tests/daemon/killed_mesh.h"
#include "tests/daemon/raw_client.h"

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  auto admin = pmcd::test::RawAdmin::open(argv[1]);
  if (admin.connection.fd() < 0) return 1;
  const pmcd::test::FakeMesh mesh = pmcd::test::killed_mesh(std::strtoull(argv[3], nullptr, 10));
  return admin.ingest(argv[2], mesh, false, 20'000) == "ok" ? 0 : 1;
}
