// SPDX-License-Identifier: GPL-3.0-or-later
// Colour refinement over the disjoint union of both meshes, with a trail to undo failed trials. A vertex's signature is
// the multiset, over its faces, of the colours of the next and the next but one corner. In an oriented manifold mesh
// two settled ends of an edge settle their whole component, so a component needs at most two choices; and since a
// component that matches can be matched for good, no choice outlives its component.
#include "codec/import/matching.h"

#include <algorithm>
#include <numeric>

namespace pmcd::import {
namespace {

using codec::Face;

std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
  x = (x ^ x >> 27) * 0x94d049bb133111ebu;
  return x ^ x >> 31;
}

class Matcher {
 public:
  explicit Matcher(const MatchingProblem& problem)
      : problem_(problem),
        count_a_(static_cast<std::uint32_t>(problem.class_a.size())),
        colour_(problem.class_a),
        next_colour_(problem.classes) {
    colour_.insert(colour_.end(), problem.class_b.begin(), problem.class_b.end());
    size_.assign(problem.classes, 0);
    for (const std::uint32_t c : colour_) ++size_[c];
    list_corners();
    list_members();
    dirty_mark_.assign(colour_.size(), false);
  }

  Matching run() {
    std::vector<std::uint32_t> dirty;
    for (std::uint32_t v = 0; v < colour_.size(); ++v) {
      if (size_[colour_[v]] > 2) dirty.push_back(v);
    }
    if (!dirty.empty()) {
      if (!refine(dirty)) return failed();
      for (const std::vector<std::uint32_t>& component : ambiguous_components()) {
        trail_.clear();  // what stands now is for good
        if (!settle(component, 0, std::nullopt)) return failed();
      }
    }
    return image();
  }

 private:
  [[nodiscard]] bool in_a(std::uint32_t v) const { return v < count_a_; }
  [[nodiscard]] std::size_t face_count() const { return problem_.faces_a.size() + problem_.faces_b.size(); }
  /// Vertex at a corner of the joined list of faces; B's vertices come after A's.
  [[nodiscard]] std::uint32_t vertex(std::size_t face, std::size_t corner) const {
    const std::size_t first_b = problem_.faces_a.size();
    return face < first_b ? problem_.faces_a[face][corner] : problem_.faces_b[face - first_b][corner] + count_a_;
  }

  void list_corners() {
    corner_begin_.assign(colour_.size() + 1, 0);
    for (std::size_t f = 0; f < face_count(); ++f) {
      for (std::size_t c = 0; c < 3; ++c) ++corner_begin_[vertex(f, c) + 1];
    }
    std::partial_sum(corner_begin_.begin(), corner_begin_.end(), corner_begin_.begin());
    corners_.resize(3 * face_count());
    std::vector<std::size_t> cursor(corner_begin_.begin(), corner_begin_.end() - 1);
    for (std::size_t f = 0; f < face_count(); ++f) {
      for (std::size_t c = 0; c < 3; ++c) corners_[cursor[vertex(f, c)]++] = 3 * f + c;
    }
  }

  /// B's vertices by class, for the candidates of a trial.
  void list_members() {
    member_begin_.assign(problem_.classes + 1, 0);
    for (const std::uint32_t c : problem_.class_b) ++member_begin_[c + 1];
    std::partial_sum(member_begin_.begin(), member_begin_.end(), member_begin_.begin());
    members_.resize(problem_.class_b.size());
    std::vector<std::uint32_t> cursor(member_begin_.begin(), member_begin_.end() - 1);
    for (std::uint32_t v = 0; v < problem_.class_b.size(); ++v) {
      members_[cursor[problem_.class_b[v]]++] = v + count_a_;
    }
  }

  template <typename Visit>
  void each_corner(std::uint32_t v, const Visit& visit) const {
    for (std::size_t i = corner_begin_[v]; i < corner_begin_[v + 1]; ++i) {
      const std::size_t f = corners_[i] / 3;
      const std::size_t c = corners_[i] % 3;
      visit(vertex(f, (c + 1) % 3), vertex(f, (c + 2) % 3));
    }
  }

  [[nodiscard]] std::uint64_t signature(std::uint32_t v) const {
    std::uint64_t sum = 0;
    each_corner(v, [&](std::uint32_t next, std::uint32_t after) {
      sum += mix(std::uint64_t{colour_[next]} << 32 | colour_[after]);
    });
    return sum;
  }

  void recolour(std::uint32_t v, std::uint32_t colour) {
    trail_.push_back({v, colour_[v]});
    --size_[colour_[v]];
    colour_[v] = colour;
    ++size_[colour];
  }

  std::uint32_t fresh_colour() {
    size_.push_back(0);
    return next_colour_++;
  }

  void undo_to(std::size_t mark) {
    while (trail_.size() > mark) {
      const auto [v, colour] = trail_.back();
      trail_.pop_back();
      --size_[colour_[v]];
      colour_[v] = colour;
      ++size_[colour];
    }
  }

  /// Splits colours until those of `dirty` and of all they affect are stable. False as soon as a colour has more
  /// vertices on one side than on the other; stuck_ is then one of them.
  bool refine(std::vector<std::uint32_t> dirty) {
    struct Entry {
      std::uint32_t colour;
      std::uint64_t signature;
      std::uint32_t v;
    };
    std::vector<Entry> entries;
    std::vector<std::uint32_t> changed;
    while (!dirty.empty()) {
      entries.clear();
      for (const std::uint32_t v : dirty) entries.push_back({colour_[v], signature(v), v});
      std::sort(entries.begin(), entries.end(), [](const Entry& x, const Entry& y) {
        if (x.colour != y.colour) return x.colour < y.colour;
        return x.signature != y.signature ? x.signature < y.signature : x.v < y.v;
      });
      changed.clear();
      for (std::size_t i = 0; i < entries.size();) {
        const std::uint32_t colour = entries[i].colour;
        std::size_t end = i;
        while (end < entries.size() && entries[end].colour == colour) ++end;
        // Vertices of the colour that are not dirty see no new colour, so they differ from all that are. If there are
        // none, the first group may keep the colour: else two equal vertices would be renamed for ever.
        bool keep = end - i == size_[colour];
        while (i < end) {
          std::size_t group = i;
          std::int64_t balance = 0;
          while (group < end && entries[group].signature == entries[i].signature) {
            balance += in_a(entries[group].v) ? 1 : -1;
            ++group;
          }
          if (balance != 0) {
            stuck_ = entries[i].v;
            return false;
          }
          if (!keep) {
            const std::uint32_t fresh = fresh_colour();
            for (std::size_t j = i; j < group; ++j) {
              recolour(entries[j].v, fresh);
              changed.push_back(entries[j].v);
            }
          }
          keep = false;
          i = group;
        }
      }
      dirty = neighbours_of(changed);
    }
    return true;
  }

  std::vector<std::uint32_t> neighbours_of(const std::vector<std::uint32_t>& vertices) {
    std::vector<std::uint32_t> out;
    const auto add = [&](std::uint32_t w) {
      if (dirty_mark_[w]) return;
      dirty_mark_[w] = true;
      out.push_back(w);
    };
    for (const std::uint32_t v : vertices) {
      each_corner(v, [&](std::uint32_t next, std::uint32_t after) {
        add(next);
        add(after);
      });
    }
    for (const std::uint32_t w : out) dirty_mark_[w] = false;
    return out;
  }

  /// A's vertices that still have a choice and a face, by connected component of A.
  [[nodiscard]] std::vector<std::vector<std::uint32_t>> ambiguous_components() const {
    std::vector<std::uint32_t> parent(count_a_);
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t v) {
      while (parent[v] != v) v = parent[v] = parent[parent[v]];
      return v;
    };
    for (const Face& face : problem_.faces_a) {
      parent[root(face[1])] = root(face[0]);
      parent[root(face[2])] = root(face[0]);
    }
    std::vector<std::uint32_t> slot(count_a_, 0);
    std::vector<std::vector<std::uint32_t>> components;
    for (std::uint32_t v = 0; v < count_a_; ++v) {
      if (size_[colour_[v]] <= 2 || corner_begin_[v] == corner_begin_[v + 1]) continue;
      std::uint32_t& s = slot[root(v)];
      if (s == 0) {
        components.emplace_back();
        s = static_cast<std::uint32_t>(components.size());
      }
      components[s - 1].push_back(v);
    }
    return components;
  }

  /// A vertex of the component that still has a choice: a neighbour of the one settled last, if there is one.
  [[nodiscard]] std::optional<std::uint32_t> next_choice(const std::vector<std::uint32_t>& component, std::size_t& from,
                                                         std::optional<std::uint32_t> last) const {
    std::optional<std::uint32_t> choice;
    const auto consider = [&](std::uint32_t v) {
      if (size_[colour_[v]] > 2) choice = v;
    };
    if (last) {
      each_corner(*last, [&](std::uint32_t next, std::uint32_t after) {
        consider(next);
        consider(after);
      });
      if (choice) return choice;
    }
    while (from < component.size() && size_[colour_[component[from]]] == 2) ++from;
    if (from < component.size()) choice = component[from];
    return choice;
  }

  /// Finds images for what still has a choice in the component; undoes its own trials if there are none.
  bool settle(const std::vector<std::uint32_t>& component, std::size_t from, std::optional<std::uint32_t> last) {
    const std::optional<std::uint32_t> choice = next_choice(component, from, last);
    if (!choice) return true;
    const std::uint32_t v = *choice;
    const std::uint32_t c = problem_.class_a[v];
    for (std::uint32_t i = member_begin_[c]; i < member_begin_[c + 1]; ++i) {
      const std::uint32_t w = members_[i];
      if (colour_[w] != colour_[v]) continue;
      const std::size_t mark = trail_.size();
      const std::uint32_t fresh = fresh_colour();
      recolour(v, fresh);
      recolour(w, fresh);
      if (refine(neighbours_of({v, w})) && settle(component, from, v)) return true;
      undo_to(mark);
    }
    stuck_ = v;
    return false;
  }

  [[nodiscard]] Matching failed() const {
    Matching matching;
    if (stuck_ && in_a(*stuck_)) matching.stuck_a = *stuck_;
    if (stuck_ && !in_a(*stuck_)) matching.stuck_b = *stuck_ - count_a_;
    return matching;
  }

  /// Every colour has as many vertices in A as in B; within a colour (only isolated vertices still share one) order
  /// does not matter.
  [[nodiscard]] Matching image() const {
    std::vector<std::uint32_t> begin(next_colour_ + std::size_t{1}, 0);
    for (std::uint32_t w = count_a_; w < colour_.size(); ++w) ++begin[colour_[w] + std::size_t{1}];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint32_t> cursor(begin.begin(), begin.end() - 1);
    std::vector<std::uint32_t> by_colour(colour_.size() - count_a_);
    for (std::uint32_t w = count_a_; w < colour_.size(); ++w) by_colour[cursor[colour_[w]]++] = w - count_a_;
    std::vector<std::uint32_t> taken(begin.begin(), begin.end() - 1);
    Matching matching{true, std::vector<std::uint32_t>(count_a_), {}, {}};
    for (std::uint32_t v = 0; v < count_a_; ++v) matching.image[v] = by_colour[taken[colour_[v]]++];
    return matching;
  }

  struct Change {
    std::uint32_t v;
    std::uint32_t colour;
  };

  const MatchingProblem& problem_;
  std::uint32_t count_a_;
  std::vector<std::uint32_t> colour_;  ///< of A's vertices, then of B's
  std::vector<std::uint32_t> size_;    ///< vertices of each colour, both meshes
  std::uint32_t next_colour_;
  std::vector<std::size_t> corner_begin_;
  std::vector<std::size_t> corners_;
  std::vector<std::uint32_t> member_begin_;
  std::vector<std::uint32_t> members_;
  std::vector<bool> dirty_mark_;
  std::vector<Change> trail_;
  std::optional<std::uint32_t> stuck_;  ///< in the joined numbering
};

}  // namespace

Matching match_vertices(const MatchingProblem& problem) {
  return Matcher(problem).run();
}

}  // namespace pmcd::import
