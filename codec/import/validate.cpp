// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's verdict on a mesh, in its own file because of what its headers cost to compile.
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>

#include "codec/import/measure.h"

namespace pmcd::import {

bool is_valid_cgal(const codec::TriangleMesh& mesh) {
  return CGAL::Polygon_mesh_processing::is_polygon_soup_a_polygon_mesh(mesh.faces);
}

}  // namespace pmcd::import
