// SPDX-License-Identifier: MIT
// Clients from a seed. The order of the draws is part of what a seed means: a client's numbers are drawn together, in
// the order of arrival.
#include "sim/scenario.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "sim/random.h"

namespace pmcd::sim {
namespace {

/// Experiment 4: on average one client in four seconds at the paper's speeds, so that some ten are there at a time.
constexpr std::size_t kPaperCrowd = 20;
constexpr double kPaperRate = 0.25;

std::optional<double> number_in(std::string_view text) {
  double value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// Up to `mark`, which goes too; all of it if there is none.
std::string_view cut(std::string_view& text, char mark) {
  const std::string_view head = text.substr(0, text.find(mark));
  text.remove_prefix(std::min(head.size() + 1, text.size()));
  return head;
}

std::uint32_t draw_line(const std::vector<Line>& lines, Random& random) {
  double total = 0;
  for (const Line& line : lines) total += line.weight;
  double drawn = random.uniform() * total;
  for (std::uint32_t i = 0; i + 1 < lines.size(); ++i) {
    drawn -= lines[i].weight;
    if (drawn < 0) return i;
  }
  return static_cast<std::uint32_t>(lines.size() - 1);
}

std::vector<std::uint32_t> draw_meshes(std::size_t count, std::size_t there_are, Random& random) {
  std::vector<std::uint32_t> all(there_are);
  std::iota(all.begin(), all.end(), 0U);
  std::vector<std::uint32_t> drawn;
  while (drawn.size() < count) {
    // The first steps of a shuffle; anew when each mesh was drawn once.
    const std::size_t at = drawn.size() % there_are;
    std::swap(all[at], all[at + random.below(there_are - at)]);
    drawn.push_back(all[at]);
  }
  return drawn;
}

}  // namespace

std::vector<Line> paper_lines() {
  return {{"modem", 33.6, 33.6, 0.150, 1}, {"dsl", 1024, 256, 0.050, 1}, {"fast-dsl", 2048, 384, 0.040, 1}};
}

Result<Line> parse_line(std::string_view text) {
  const std::string whole(text);
  const auto wrong = [&whole](const std::string& what) {
    return wrong_usage("line \"" + whole + "\": " + what +
                       "; it is NAME=DOWN/UP/RTT_MS[:WEIGHT], kbit/s and milliseconds");
  };
  Line line;
  if (text.find('=') == std::string_view::npos) return wrong("has no =");
  line.name = cut(text, '=');
  if (line.name.empty()) return wrong("has no name");
  std::string_view speeds = cut(text, ':');
  const bool weighted = !text.empty() || whole.back() == ':';
  const std::pair<const char*, double*> fields[] = {
      {"DOWN", &line.down_kbit}, {"UP", &line.up_kbit}, {"RTT_MS", &line.round_trip}};
  for (const auto& [name, value] : fields) {
    const std::string_view cell = name == fields[2].first ? std::exchange(speeds, {}) : cut(speeds, '/');
    const auto number = number_in(cell);
    const double least = value == &line.round_trip ? 0 : 0.1;
    if (!number || *number < least || *number > 1e9) {
      return wrong(std::string(name) + " is \"" + std::string(cell) + "\", not a number from " +
                   (least > 0 ? "0.1" : "0") + " to 1000000000");
    }
    *value = *number;
  }
  line.round_trip /= 1000;
  if (weighted) {
    const auto number = number_in(text);
    if (!number || *number <= 0 || *number > 1e9) {
      return wrong("WEIGHT is \"" + std::string(text) + "\", not a number above 0");
    }
    line.weight = *number;
  }
  return line;
}

Result<ArrivalProcess> parse_arrivals(std::string_view text) {
  const std::string whole(text);
  if (text == "at-once") return ArrivalProcess{};
  const std::string_view kind = cut(text, ':');
  const auto number = number_in(text);
  if (kind == "every" && number && *number >= 0 && *number <= 1e6) return ArrivalProcess{Arrivals::every, *number};
  if (kind == "poisson" && number && *number >= 1e-6 && *number <= 1e9) {
    return ArrivalProcess{Arrivals::poisson, *number};
  }
  return wrong_usage("arrivals \"" + whole + "\": not at-once, every:SECONDS or poisson:CLIENTS_A_SECOND");
}

std::vector<ClientPlan> draw_clients(const Scenario& scenario, const Crowd& crowd) {
  Random random(crowd.seed);
  std::vector<ClientPlan> clients(crowd.clients);
  double now = 0;
  for (ClientPlan& client : clients) {
    if (crowd.arrivals.kind == Arrivals::poisson) now += random.gap(crowd.arrivals.value);
    client.arrives = now;
    client.line = draw_line(scenario.lines, random);
    client.meshes = draw_meshes(crowd.meshes_each, scenario.meshes.size(), random);
    client.stalls = random.uniform() < crowd.stall_share;
    if (crowd.arrivals.kind == Arrivals::every) now += crowd.arrivals.value;
  }
  return clients;
}

std::vector<ClientPlan> paper_clients(const Scenario& scenario, int experiment, std::uint64_t seed, double scale) {
  const auto mesh = [&scenario](std::size_t i) { return static_cast<std::uint32_t>(i % scenario.meshes.size()); };
  if (experiment == 4) {
    Crowd crowd{kPaperCrowd, {Arrivals::poisson, kPaperRate * scale}, 1, 0, seed};
    std::vector<ClientPlan> clients = draw_clients(scenario, crowd);
    clients[kPaperCrowd / 2].stalls = true;
    return clients;
  }
  std::vector<ClientPlan> clients(3);
  for (std::uint32_t i = 0; i < 3; ++i) {
    clients[i].line = experiment == 3 ? 2 : i;
    clients[i].meshes = {mesh(experiment == 1 ? 0 : i)};
  }
  return clients;
}

double queue_of(const Tcp& tcp, double kbit) {
  return std::max(kbit * 125 * tcp.queue_seconds, tcp.queue_bytes);
}

void scale_speeds(Scenario& scenario, double factor) {
  scenario.uplink_kbit *= factor;
  for (Line& line : scenario.lines) {
    line.down_kbit *= factor;
    line.up_kbit *= factor;
  }
}

}  // namespace pmcd::sim
