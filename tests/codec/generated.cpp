// SPDX-License-Identifier: MIT
#include "tests/codec/generated.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

namespace pmcd::codec::testing {
namespace {

double round_to(double value, Scalar scalar) {
  return scalar == Scalar::float32 ? static_cast<double>(static_cast<float>(value)) : value;
}

void round_all(TriangleMesh& mesh) {
  for (Position& p : mesh.positions) {
    for (double& x : p) x = round_to(x, mesh.scalar);
  }
}

// Point k of n on the unit circle, each quarter by the rational parametrisation: no sine, no cosine.
std::array<double, 2> on_circle(std::uint32_t k, std::uint32_t n) {
  const double quarters = 4.0 * k / n;
  const auto quarter = static_cast<unsigned>(quarters);
  const double t = quarters - quarter;
  const double x = (1 - t * t) / (1 + t * t);
  const double y = 2 * t / (1 + t * t);
  switch (quarter % 4) {
    case 0:
      return {x, y};
    case 1:
      return {-y, x};
    case 2:
      return {-x, -y};
    default:
      return {y, -x};
  }
}

Position to_unit_length(const Position& p) {
  const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
  return {p[0] / length, p[1] / length, p[2] / length};
}

Position middle(const Position& a, const Position& b) {
  return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

std::pair<std::uint32_t, std::uint32_t> edge_name(std::uint32_t a, std::uint32_t b) {
  return a < b ? std::pair{a, b} : std::pair{b, a};
}

void add_quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.faces.push_back({a, b, c});
  mesh.faces.push_back({a, c, d});
}

void drop_unused(TriangleMesh& mesh) {
  std::vector<std::uint32_t> name(mesh.positions.size(), 0xFFFFFFFFu);
  std::vector<Position> used;
  for (Face& face : mesh.faces) {
    for (std::uint32_t& v : face) {
      if (name[v] == 0xFFFFFFFFu) {
        name[v] = static_cast<std::uint32_t>(used.size());
        used.push_back(mesh.positions[v]);
      }
      v = name[v];
    }
  }
  mesh.positions = std::move(used);
}

}  // namespace

TriangleMesh single_triangle() {
  return {Scalar::float32, {{0, 0, 0}, {1, 0, 0.25}, {0, 1, 0.5}}, {{0, 1, 2}}};
}

TriangleMesh tetrahedron() {
  return {Scalar::float32, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

TriangleMesh octahedron() {
  return {Scalar::float32,
          {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
          {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
}

TriangleMesh sphere(unsigned levels) {
  TriangleMesh mesh = octahedron();
  for (unsigned level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    auto middle_of = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, is_new] = middles.try_emplace(edge_name(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
      if (is_new) mesh.positions.push_back(to_unit_length(middle(mesh.positions[a], mesh.positions[b])));
      return it->second;
    };
    std::vector<Face> faces;
    for (const Face& f : mesh.faces) {
      const std::uint32_t ab = middle_of(f[0], f[1]);
      const std::uint32_t bc = middle_of(f[1], f[2]);
      const std::uint32_t ca = middle_of(f[2], f[0]);
      faces.insert(faces.end(), {{f[0], ab, ca}, {f[1], bc, ab}, {f[2], ca, bc}, {ab, bc, ca}});
    }
    mesh.faces = std::move(faces);
  }
  round_all(mesh);
  return mesh;
}

TriangleMesh uv_sphere(std::uint32_t rings, std::uint32_t sides) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 1}, {0, 0, -1}};
  auto at = [&](std::uint32_t r, std::uint32_t s) { return 2 + r * sides + s % sides; };
  for (std::uint32_t r = 0; r < rings; ++r) {
    const auto [height, radius] = on_circle(r + 1, 2 * (rings + 1));
    for (std::uint32_t s = 0; s < sides; ++s) {
      const auto [x, y] = on_circle(s, sides);
      mesh.positions.push_back({radius * x, radius * y, height});
    }
  }
  for (std::uint32_t s = 0; s < sides; ++s) {
    mesh.faces.push_back({0, at(0, s), at(0, s + 1)});
    for (std::uint32_t r = 0; r + 1 < rings; ++r)
      add_quad(mesh, at(r, s), at(r + 1, s), at(r + 1, s + 1), at(r, s + 1));
    mesh.faces.push_back({1, at(rings - 1, s + 1), at(rings - 1, s)});
  }
  round_all(mesh);
  return mesh;
}

TriangleMesh torus(std::uint32_t rings, std::uint32_t sides) {
  TriangleMesh mesh;
  auto at = [&](std::uint32_t r, std::uint32_t s) { return r % rings * sides + s % sides; };
  for (std::uint32_t r = 0; r < rings; ++r) {
    const auto [cos_u, sin_u] = on_circle(r, rings);
    for (std::uint32_t s = 0; s < sides; ++s) {
      const auto [cos_v, sin_v] = on_circle(s, sides);
      mesh.positions.push_back({(3 + cos_v) * cos_u, (3 + cos_v) * sin_u, sin_v});
      add_quad(mesh, at(r, s), at(r + 1, s), at(r + 1, s + 1), at(r, s + 1));
    }
  }
  round_all(mesh);
  return mesh;
}

TriangleMesh holed_plate(std::uint32_t holes, std::uint32_t cells) {
  // Along x: a bar of `cells`, then hole, bar, hole, bar ...; along y: bar, hole, bar.
  const std::uint32_t columns = cells * (2 * holes + 1);
  const std::uint32_t rows = 3 * cells;
  auto solid = [&](std::uint32_t x, std::uint32_t y) {
    return x < columns && y < rows && !(x / cells % 2 == 1 && y / cells == 1);
  };
  TriangleMesh mesh;
  const std::uint32_t layer = (columns + 1) * (rows + 1);
  auto at = [&](std::uint32_t x, std::uint32_t y) { return y * (columns + 1) + x; };
  for (const double z : {1.0, -1.0}) {
    for (std::uint32_t y = 0; y <= rows; ++y) {
      for (std::uint32_t x = 0; x <= columns; ++x) {
        mesh.positions.push_back({static_cast<double>(x) / cells, static_cast<double>(y) / cells,
                                  z + 0.1 * on_circle(x + 3 * y, columns + rows)[0]});
      }
    }
  }
  auto wall = [&](std::uint32_t a, std::uint32_t b) { add_quad(mesh, b, a, a + layer, b + layer); };
  for (std::uint32_t y = 0; y < rows; ++y) {
    for (std::uint32_t x = 0; x < columns; ++x) {
      if (!solid(x, y)) continue;
      const std::uint32_t a = at(x, y);
      const std::uint32_t b = at(x + 1, y);
      const std::uint32_t c = at(x + 1, y + 1);
      const std::uint32_t d = at(x, y + 1);
      add_quad(mesh, a, b, c, d);
      add_quad(mesh, d + layer, c + layer, b + layer, a + layer);
      if (y == 0 || !solid(x, y - 1)) wall(a, b);
      if (!solid(x + 1, y)) wall(b, c);
      if (!solid(x, y + 1)) wall(c, d);
      if (x == 0 || !solid(x - 1, y)) wall(d, a);
    }
  }
  drop_unused(mesh);
  round_all(mesh);
  return mesh;
}

TriangleMesh grid(std::uint32_t columns, std::uint32_t rows, std::uint32_t holes) {
  TriangleMesh mesh;
  auto at = [&](std::uint32_t x, std::uint32_t y) { return y * (columns + 1) + x; };
  for (std::uint32_t y = 0; y <= rows; ++y) {
    for (std::uint32_t x = 0; x <= columns; ++x) {
      const double height = 0.3 * on_circle(5 * x, columns + 1)[0] + 0.2 * on_circle(3 * y + x, rows + columns)[1];
      mesh.positions.push_back({static_cast<double>(x) / columns, static_cast<double>(y) / columns, height});
    }
  }
  std::uint32_t left = holes;
  for (std::uint32_t y = 0; y < rows; ++y) {
    for (std::uint32_t x = 0; x < columns; ++x) {
      // Every third cell of every third row: holes never touch each other or the rim.
      if (left > 0 && x % 3 == 1 && y % 3 == 1 && x + 1 < columns && y + 1 < rows) {
        --left;
        continue;
      }
      add_quad(mesh, at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1));
    }
  }
  round_all(mesh);
  return mesh;
}

TriangleMesh bipyramid(std::uint32_t sides) {
  TriangleMesh mesh = cone(sides);
  mesh.positions.push_back({0, 0, -1});
  for (std::uint32_t s = 0; s < sides; ++s) mesh.faces.push_back({sides + 1, 1 + (s + 1) % sides, 1 + s});
  return mesh;
}

TriangleMesh cone(std::uint32_t sides) {
  TriangleMesh mesh;
  mesh.positions.push_back({0, 0, 1});
  for (std::uint32_t s = 0; s < sides; ++s) {
    const auto [x, y] = on_circle(s, sides);
    mesh.positions.push_back({x, y, 0});
    mesh.faces.push_back({0, 1 + s, 1 + (s + 1) % sides});
  }
  round_all(mesh);
  return mesh;
}

TriangleMesh facing_threes() {
  TriangleMesh mesh = octahedron();
  const Face a = mesh.faces[0];  // 0 2 4
  const Face b = mesh.faces[1];  // 2 1 4
  mesh.faces.erase(mesh.faces.begin(), mesh.faces.begin() + 2);
  for (const Face& f : {a, b}) {
    const auto centre = static_cast<std::uint32_t>(mesh.positions.size());
    Position p{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::uint32_t v : f) p[axis] += mesh.positions[v][axis] * 0.375;
    }
    mesh.positions.push_back(p);
    mesh.faces.insert(mesh.faces.end(), {{f[0], f[1], centre}, {f[1], f[2], centre}, {f[2], f[0], centre}});
  }
  round_all(mesh);
  return mesh;
}

TriangleMesh joined(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh mesh = a;
  const auto shift = static_cast<std::uint32_t>(a.positions.size());
  mesh.positions.insert(mesh.positions.end(), b.positions.begin(), b.positions.end());
  for (const Face& f : b.faces) mesh.faces.push_back({f[0] + shift, f[1] + shift, f[2] + shift});
  return mesh;
}

void split_faces(TriangleMesh& mesh, std::uint32_t count, Random& random) {
  for (std::uint32_t i = 0; i < count && !mesh.faces.empty(); ++i) {
    const std::uint32_t at = random.below(mesh.faces.size());
    const Face f = mesh.faces[at];
    const auto centre = static_cast<std::uint32_t>(mesh.positions.size());
    Position p{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double sum = mesh.positions[f[0]][axis] + mesh.positions[f[1]][axis] + mesh.positions[f[2]][axis];
      p[axis] = round_to(sum / 3, mesh.scalar);
    }
    mesh.positions.push_back(p);
    mesh.faces[at] = {f[0], f[1], centre};
    mesh.faces.push_back({f[1], f[2], centre});
    mesh.faces.push_back({f[2], f[0], centre});
  }
}

void flip_edges(TriangleMesh& mesh, std::uint32_t count, Random& random) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> face_of;  // of directed edges
  auto enter = [&](std::uint32_t f) {
    for (std::size_t c = 0; c < 3; ++c) face_of[{mesh.faces[f][c], mesh.faces[f][(c + 1) % 3]}] = f;
  };
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) enter(f);
  for (std::uint32_t i = 0; i < count && !mesh.faces.empty(); ++i) {
    const std::uint32_t f = random.below(mesh.faces.size());
    const std::uint32_t c = random.below(3);
    const std::uint32_t a = mesh.faces[f][c];
    const std::uint32_t b = mesh.faces[f][(c + 1) % 3];
    const std::uint32_t left = mesh.faces[f][(c + 2) % 3];
    const auto across = face_of.find({b, a});
    if (across == face_of.end()) continue;
    const std::uint32_t g = across->second;
    const Face other = mesh.faces[g];
    const std::uint32_t right =
        other[0] != a && other[0] != b ? other[0] : (other[1] != a && other[1] != b ? other[1] : other[2]);
    if (left == right || face_of.count({left, right}) != 0 || face_of.count({right, left}) != 0) continue;
    face_of.erase({a, b});
    face_of.erase({b, a});
    mesh.faces[f] = {left, right, b};
    mesh.faces[g] = {right, left, a};
    enter(f);
    enter(g);
  }
}

void add_isolated(TriangleMesh& mesh, std::uint32_t count, Random& random) {
  for (std::uint32_t i = 0; i < count; ++i) {
    if (i % 3 == 2) {
      mesh.positions.push_back(mesh.positions.back());
      continue;
    }
    mesh.positions.push_back({round_to(random.unit() * 4 - 2, mesh.scalar),
                              round_to(random.unit() * 4 - 2, mesh.scalar),
                              round_to(random.unit() * 4 - 2, mesh.scalar)});
  }
}

TriangleMesh renumbered(const TriangleMesh& mesh, Random& random) {
  std::vector<std::uint32_t> name(mesh.positions.size());
  std::iota(name.begin(), name.end(), 0u);
  auto shuffle = [&](auto& list) {
    for (std::size_t i = list.size(); i > 1; --i) std::swap(list[i - 1], list[random.below(i)]);
  };
  shuffle(name);
  TriangleMesh result;
  result.scalar = mesh.scalar;
  result.positions.resize(mesh.positions.size());
  for (std::size_t v = 0; v < name.size(); ++v) result.positions[name[v]] = mesh.positions[v];
  for (const Face& f : mesh.faces) {
    Face g{name[f[0]], name[f[1]], name[f[2]]};
    std::rotate(g.begin(), g.begin() + random.below(3), g.end());
    result.faces.push_back(g);
  }
  shuffle(result.faces);
  return result;
}

void jitter(TriangleMesh& mesh, double amplitude, Random& random) {
  for (Position& p : mesh.positions) {
    for (double& x : p) x = round_to(x + amplitude * (2 * random.unit() - 1), mesh.scalar);
  }
}

TriangleMesh as_float64(TriangleMesh mesh, Random& random) {
  mesh.scalar = Scalar::float64;
  jitter(mesh, 1e-9, random);
  return mesh;
}

TriangleMesh scaled(TriangleMesh mesh, double factor) {
  for (Position& p : mesh.positions) {
    for (double& x : p) x = round_to(x * factor, mesh.scalar);
  }
  return mesh;
}

void squash(TriangleMesh& mesh, std::uint32_t count, Random& random) {
  for (std::uint32_t i = 0; i < count && !mesh.faces.empty(); ++i) {
    const Face& f = mesh.faces[random.below(mesh.faces.size())];
    mesh.positions[f[1]] = mesh.positions[f[0]];
  }
}

void sprinkle_zeros(TriangleMesh& mesh, Random& random) {
  constexpr double kDenormal = 1.401298464324817e-45;  // the smallest float32
  for (Position& p : mesh.positions) {
    for (double& x : p) {
      if (!random.one_in(4)) continue;
      const std::array<double, 5> special = {0.0, -0.0, kDenormal, -kDenormal, 37 * kDenormal};
      x = special[random.below(special.size())];
    }
  }
}

// One draw a statement: compilers differ in the order in which they evaluate a call's arguments.
TriangleMesh any_mesh(std::uint64_t seed) {
  Random random(seed);
  auto shape = [&]() -> TriangleMesh {
    switch (random.below(12)) {
      case 0:
        return sphere(1 + random.below(3));
      case 1: {
        const std::uint32_t sides = 3 + random.below(20);
        return uv_sphere(2 + random.below(12), sides);
      }
      case 2: {
        const std::uint32_t sides = 3 + random.below(14);
        return torus(3 + random.below(14), sides);
      }
      case 3: {
        const std::uint32_t cells = 1 + random.below(3);
        return holed_plate(1 + random.below(3), cells);
      }
      case 4: {
        const std::uint32_t holes = random.below(8);
        const std::uint32_t rows = 3 + random.below(15);
        return grid(3 + random.below(15), rows, holes);
      }
      case 5:
        return bipyramid(3 + random.below(60));
      case 6:
        return cone(3 + random.below(60));
      case 7:
        return facing_threes();
      case 8:
        return single_triangle();
      case 9:
        return tetrahedron();
      case 10: {
        const std::uint32_t rows = 1 + random.below(3);
        return grid(1 + random.below(3), rows, 0);
      }
      default:
        return octahedron();
    }
  };
  TriangleMesh mesh = shape();
  while (random.one_in(3) && mesh.positions.size() < 500) {
    const double factor = random.one_in(4) ? 1e-3 : 1 + random.unit();
    TriangleMesh other = scaled(shape(), factor);
    for (Position& p : other.positions)
      p[random.below(3)] = static_cast<double>(static_cast<float>(p[0] + random.unit()));
    mesh = joined(mesh, other);
  }
  if (random.one_in(2)) split_faces(mesh, random.below(60), random);
  if (random.one_in(2)) flip_edges(mesh, random.below(400), random);
  if (random.one_in(4)) add_isolated(mesh, random.below(30), random);
  if (random.one_in(4)) mesh = as_float64(std::move(mesh), random);
  if (!random.one_in(4)) jitter(mesh, random.one_in(2) ? 1e-3 : 0.05, random);
  if (random.one_in(5)) squash(mesh, random.below(20), random);
  if (random.one_in(6)) sprinkle_zeros(mesh, random);
  if (random.one_in(10)) mesh = scaled(std::move(mesh), 1e30);
  if (random.one_in(10)) mesh = scaled(std::move(mesh), 1e-42);  // denormal extents
  if (random.one_in(12)) {
    const std::uint32_t axis = random.below(3);
    for (Position& p : mesh.positions) p[axis] = 0.5;  // flat
  }
  return renumbered(mesh, random);
}

std::vector<std::pair<std::string, TriangleMesh>> zoo() {
  std::vector<std::pair<std::string, TriangleMesh>> meshes;
  auto add = [&](const char* name, TriangleMesh mesh) { meshes.emplace_back(name, std::move(mesh)); };
  Random random(2026);
  auto changed = [&](TriangleMesh mesh, auto change) {
    change(mesh);
    return mesh;
  };
  add("empty", {});
  add("single_vertex_at_origin", {Scalar::float32, {{0, 0, 0}}, {}});
  add("single_vertex", {Scalar::float32, {{1.5, -2.25, 3e-20f}}, {}});
  add("isolated_only",
      changed(TriangleMesh{Scalar::float32, {{1, 1, 1}}, {}}, [&](auto& m) { add_isolated(m, 40, random); }));
  add("isolated_in_one_point", {Scalar::float64, std::vector<Position>(50, {0.1, 0, -0.0}), {}});
  add("single_triangle", single_triangle());
  add("tetrahedron", tetrahedron());
  add("octahedron", octahedron());
  add("facing_threes", facing_threes());
  add("sphere", sphere(4));
  add("sphere_noise", changed(sphere(4), [&](auto& m) { jitter(m, 0.01, random); }));
  add("sphere_double", as_float64(sphere(3), random));
  add("sphere_huge", scaled(changed(sphere(3), [&](auto& m) { jitter(m, 0.01, random); }), 1e30));
  add("sphere_denormal", scaled(sphere(3), 1e-43));
  add("sphere_zeros", changed(sphere(3), [&](auto& m) { sprinkle_zeros(m, random); }));
  add("uv_sphere", uv_sphere(30, 40));
  add("torus", torus(30, 20));
  add("two_holes", holed_plate(2, 4));
  add("five_holes", holed_plate(5, 3));
  add("grid", grid(30, 20, 0));
  add("grid_holes", grid(31, 31, 60));
  add("strip", grid(60, 1, 0));
  add("bipyramid", bipyramid(300));
  add("cone", cone(300));
  add("stellar", changed(sphere(2), [&](auto& m) { split_faces(m, 600, random); }));
  add("flipped", changed(sphere(3), [&](auto& m) { flip_edges(m, 3000, random); }));
  add("flipped_grid", changed(grid(20, 20, 12), [&](auto& m) { flip_edges(m, 1500, random); }));
  add("squashed", changed(sphere(3), [&](auto& m) { squash(m, 60, random); }));
  add("one_point", changed(torus(10, 10), [](auto& m) { m.positions.assign(m.positions.size(), {1, 2, 3}); }));
  add("at_origin", changed(sphere(2), [](auto& m) { m.positions.assign(m.positions.size(), {0, 0, 0}); }));
  add("collinear", changed(sphere(3), [](auto& m) {
        for (Position& p : m.positions) p[1] = p[2] = 0;
      }));
  add("flat", changed(grid(25, 25, 5), [](auto& m) {
        for (Position& p : m.positions) p[2] = -0.0;
      }));
  add("with_isolated", changed(torus(12, 12), [&](auto& m) { add_isolated(m, 30, random); }));
  TriangleMesh many = sphere(4);
  for (int i = 0; i < 40; ++i) {
    many = joined(many, i % 3 == 0 ? tetrahedron() : (i % 3 == 1 ? single_triangle() : scaled(sphere(1), 0.01)));
  }
  jitter(many, 0.5, random);
  add("many_components", std::move(many));
  return meshes;
}

}  // namespace pmcd::codec::testing
