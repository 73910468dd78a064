// SPDX-License-Identifier: GPL-3.0-or-later
// The readers of PLY, OBJ, OFF and STL: first byte: which, and whether strictly; the rest is the file. It is read, or
// refused with a place; what is read has faces of its own vertices only, and is read again after it was written.
#include <array>
#include <string>

#include "codec/import/read_mesh.h"
#include "codec/import/write_mesh.h"
#include "tests/fuzz/check.h"
#include "tests/fuzz/script.h"

namespace pmcd::fuzz {

void mesh_file(Input input) {
  static const std::array<std::string, 4> kExtensions{"ply", "obj", "off", "stl"};
  Script script(input);
  const std::uint8_t choice = script.u8();
  const std::string& extension = kExtensions[choice % 4];
  import::ImportOptions options;
  options.strict = (choice & 4) != 0;
  options.as_double = (choice & 8) != 0;
  const Input rest = script.rest();
  const std::vector<std::byte> file(rest.begin(), rest.end());
  const auto read = import::read_mesh(file, extension, options);
  if (!read.ok()) {
    check(!read.error().message.empty(), "an error without a word");
    return;
  }
  const codec::TriangleMesh& mesh = read->mesh;
  for (const codec::Face& face : mesh.faces) {
    for (const std::uint32_t vertex : face) check(vertex < mesh.positions.size(), "a face without its vertex");
  }
  const auto written = import::format_mesh(mesh, "ply");
  check(written.ok(), "a mesh that was read cannot be written");
  const auto again = import::read_mesh(written->bytes, "ply");
  check(again.ok() && again->mesh.positions.size() == mesh.positions.size() &&
            again->mesh.faces.size() == mesh.faces.size(),
        "a mesh that was written cannot be read");
}

}  // namespace pmcd::fuzz
