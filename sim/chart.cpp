// SPDX-License-Identifier: MIT
// Coordinates with one decimal, so that the text is the same wherever it is made.
#include "sim/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace pmcd::sim {
namespace {

constexpr double kLeft = 60, kTop = 50, kWidth = 560, kHeight = 320;
constexpr double kLegend = 20;  ///< between plot and legend
constexpr std::size_t kCorners = 200;
/// Colours that those tell apart who see no red or no green (Okabe and Ito's), and dashes for a second round of them.
constexpr std::array kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                 "#56b4e9", "#e69f00", "#000000", "#999999"};

std::string one(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f", value);
  return text.data();
}

std::string tick_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    safe += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  }
  return safe;
}

std::string text_at(double x, double y, const std::string& anchor, const std::string& text) {
  return "<text x=\"" + one(x) + "\" y=\"" + one(y) + "\" text-anchor=\"" + anchor + "\">" + escaped(text) +
         "</text>\n";
}

std::string line_at(double x1, double y1, double x2, double y2, const std::string& style) {
  return "<line x1=\"" + one(x1) + "\" y1=\"" + one(y1) + "\" x2=\"" + one(x2) + "\" y2=\"" + one(y2) + "\" " + style +
         "/>\n";
}

std::vector<double> sorted_times(const Run& run) {
  std::vector<double> times;
  for (const Fetch& fetch : run.outcome.fetches) {
    if (fetch.complete >= 0) times.push_back(fetch.complete);
  }
  std::sort(times.begin(), times.end());
  return times;
}

/// 1, 2 or 5 times a power of ten, so that some five of them make up `span`.
double tick_step(double span) {
  const double raw = std::max(span, 1e-6) / 5;
  double power = 1;
  while (power > raw) power /= 10;
  while (power * 10 <= raw) power *= 10;
  return raw <= 2 * power ? 2 * power : raw <= 5 * power ? 5 * power : 10 * power;
}

std::string axes(double end, double step) {
  std::string svg;
  for (int i = 0; i <= 4; ++i) {
    const double y = kTop + kHeight * (1 - i / 4.0);
    svg += line_at(kLeft, y, kLeft + kWidth, y, "stroke=\"#dddddd\"");
    svg += text_at(kLeft - 8, y + 4, "end", std::to_string(25 * i) + " %");
  }
  for (int i = 0; i * step <= end * 1.0001; ++i) {
    const double x = kLeft + kWidth * i * step / end;
    svg += line_at(x, kTop + kHeight, x, kTop + kHeight + 5, "stroke=\"#333333\"");
    svg += text_at(x, kTop + kHeight + 20, "middle", tick_text(i * step));
  }
  svg += line_at(kLeft, kTop + kHeight, kLeft + kWidth, kTop + kHeight, "stroke=\"#333333\"");
  svg += text_at(kLeft + kWidth / 2, kTop + kHeight + 40, "middle", "seconds until the mesh was complete");
  return svg;
}

std::string curve(const std::vector<double>& times, std::size_t all, double end, const std::string& style) {
  const auto x = [end](double time) { return kLeft + kWidth * std::min(time, end) / end; };
  const auto y = [all](std::size_t count) {
    return kTop + kHeight * (1 - static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(all, 1)));
  };
  std::string points = one(kLeft) + "," + one(y(0));
  const std::size_t corners = std::min(kCorners, times.size());
  std::size_t before = 0;
  for (std::size_t i = 1; i <= corners; ++i) {
    const std::size_t count = times.size() * i / corners;
    const double at = times[count - 1];
    if (at > end) break;
    points += " " + one(x(at)) + "," + one(y(before)) + " " + one(x(at)) + "," + one(y(count));
    before = count;
  }
  points += " " + one(kLeft + kWidth) + "," + one(y(before));
  return "<polyline points=\"" + points + "\" fill=\"none\" stroke-width=\"2\" " + style + "/>\n";
}

}  // namespace

std::string chart_of(const std::string& title, const std::vector<Run>& runs) {
  double end = 0;
  std::size_t longest = 0;
  for (const Run& run : runs) {
    const auto times = sorted_times(run);
    if (!times.empty()) end = std::max(end, times.size() < 100 ? times.back() : times[times.size() * 99 / 100]);
    longest = std::max(longest, text_of(run.policy).size());
  }
  const double step = tick_step(end);
  end = step * std::max(1.0, std::ceil(end / step));
  const double width = kLeft + kWidth + kLegend + 40 + 7.0 * static_cast<double>(longest);
  const double height = kTop + kHeight + 60;
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + one(width) + "\" height=\"" + one(height) +
      "\" viewBox=\"0 0 " + one(width) + " " + one(height) +
      "\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  svg += "<g font-size=\"15\">" + text_at(kLeft, 28, "start", title) + "</g>\n" + axes(end, step);
  double y = kTop + 10;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::string style = std::string("stroke=\"") + kColours[i % kColours.size()] + "\"" +
                              (i / kColours.size() % 2 == 1 ? " stroke-dasharray=\"6 3\"" : "");
    svg += curve(sorted_times(runs[i]), runs[i].outcome.fetches.size(), end, style);
    const double x = kLeft + kWidth + kLegend;
    svg += line_at(x, y, x + 24, y, style + " stroke-width=\"3\"");
    svg += text_at(x + 30, y + 4, "start", text_of(runs[i].policy));
    y += 20;
  }
  return svg + "</svg>\n";
}

}  // namespace pmcd::sim
