// SPDX-License-Identifier: MIT
// What each packet of a mesh costs and is worth, as plain numbers: what a rule weighs against each other. Made once a
// mesh and shared by all its requests. It knows no packet format and reads nothing.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace pmcd::scheduler {

class MeshProfile {
 public:
  /// What packet k leads to.
  struct Level {
    std::uint64_t bytes = 0;     ///< of the packet
    std::uint64_t vertices = 0;  ///< of the level
    double error = -1;           ///< of the level, relative to the mesh's diagonal; negative: not measured
  };

  /// `finest`: an error below which none is visible, relative to the diagonal: half a lattice step, or less for a mesh
  /// without one. Errors are floored at it, and at 2^-20. Where errors are not measured, a level is taken for as much
  /// better as it has more vertices: the distance of a surface from its triangles falls with their area.
  MeshProfile(std::span<const Level> levels, double finest);

  [[nodiscard]] std::size_t packets() const { return bytes_.size() - 1; }
  /// Bytes of the packets behind `packet`. REQUIRES: packet < packets().
  [[nodiscard]] std::uint64_t bytes_behind(std::uint32_t packet) const { return bytes_.back() - bytes_[packet + 1]; }
  /// By how many halvings of the error packet k brings the mesh forward: log2(error before / error after), negative
  /// where it gets worse; 0 for the base packet, before which there is nothing. REQUIRES: packet < packets().
  [[nodiscard]] double gain(std::uint32_t packet) const { return gain_[packet + 1] - gain_[packet]; }
  /// By how many halvings the error has fallen since the first level for who has all packets before `packet`.
  /// REQUIRES: 1 <= packet <= packets().
  [[nodiscard]] double halvings(std::uint32_t packet) const { return gain_[packet] - gain_[1]; }
  /// The steepest way forward from a packet of which `remaining` bytes are still to be sent: the largest ratio of gain
  /// to bytes over all runs of packets that begin with it; 0 if nothing gets better. REQUIRES: packet < packets(),
  /// remaining > 0. [O(packets behind it)]
  [[nodiscard]] double steepest(std::uint32_t packet, std::uint64_t remaining) const;

 private:
  std::vector<std::uint64_t> bytes_;  ///< of the first k packets together
  std::vector<double> gain_;          ///< the same for gains; a level that is worse takes away what the next gives back
};

}  // namespace pmcd::scheduler
