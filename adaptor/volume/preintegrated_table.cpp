// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/volume/preintegrated_table.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

namespace vestige {
namespace {

constexpr int kCellsPerRange = 1024;
constexpr int kMostCells = 4096;
/// What a cell without pieces, and a piece, may be off the function, in its greatest extinctions.
constexpr double kCellTolerance = 1.0 / 64.0, kPieceTolerance = 1.0 / 1024.0;

/// Where extinction is taken as linear; in cells.
struct Piece {
  double from = 0.0, to = 0.0;
  double start = 0.0, end = 0.0;  ///< extinction * cell
  double integral() const { return 0.5 * (start + end) * (to - from); }
  double at(double x) const { return start + (x - from) / (to - from) * (end - start); }
};

/// The line through the two points of Gauss's rule has the mean of any cubic, and jumps at the
/// piece's ends do not matter; where it would cross zero, the mean alone.
template <typename Extinction>
Piece pieceOf(double from, double to, const Extinction& extinction) {
  const double offset = 0.5 / std::sqrt(3.0);
  const double a = extinction(from + (0.5 - offset) * (to - from));
  const double b = extinction(from + (0.5 + offset) * (to - from));
  const double mean = 0.5 * (a + b), half = (b - a) / (4.0 * offset);
  if (std::abs(half) > mean) return {from, to, mean, mean};
  return {from, to, mean - half, mean + half};
}

/// Halves as long as extinction is off a line by more than `tolerance`: the logarithm of opacity
/// is.
template <typename Extinction>
void appendPieces(std::vector<Piece>& pieces, double from, double to, double tolerance,
                  const Extinction& extinction, int depth = 6) {
  const Piece piece = pieceOf(from, to, extinction);
  const double middle = 0.5 * (from + to);
  if (depth > 0 && std::abs(extinction(middle) - piece.at(middle)) > tolerance) {
    appendPieces(pieces, from, middle, tolerance, extinction, depth - 1);
    appendPieces(pieces, middle, to, tolerance, extinction, depth - 1);
  } else {
    pieces.push_back(piece);
  }
}

/// From the first one's start to the last one's end, shifted to have their integral.
Piece pieceLike(const std::vector<Piece>& pieces) {
  Piece all{pieces.front().from, pieces.back().to, pieces.front().start, pieces.back().end};
  double integral = 0.0;
  for (const Piece& piece : pieces) integral += piece.integral();
  const double mean = integral / (all.to - all.from), half = 0.5 * (all.end - all.start);
  all.start = mean - half;
  all.end = mean + half;
  if (std::abs(half) > mean) all.start = all.end = mean;
  return all;
}

/// One piece with the integral of several, if it is nowhere off them by more than `tolerance`.
std::vector<Piece> merged(std::vector<Piece> pieces, double tolerance) {
  if (pieces.size() < 2) return pieces;
  Piece all = pieceLike(pieces);
  for (const Piece& piece : pieces) {
    if (std::max(std::abs(all.at(piece.from) - piece.start),
                 std::abs(all.at(piece.to) - piece.end)) > tolerance) {
      return pieces;
    }
  }
  return {all};
}

}  // namespace

PreintegratedTable::PreintegratedTable(const TransferFunction& base,
                                       const IntervalPartition& partition, double scale) {
  // The partition's range, and beyond it as far as the function goes on changing, within reason:
  // values that far outside are all "below" or "above".
  double first = 0.0, last = 1.0;
  std::vector<double> points;
  for (const OpacityPoint& point : base.opacityPoints()) {
    points.push_back(partition.normalised(point.value));
  }
  if (!points.empty()) {
    first = std::clamp(points.front(), -1.5, 0.0);
    last = std::clamp(points.back(), 1.0, 2.5);
  }
  const int inner = std::min(kMostCells, int(std::ceil((last - first) * kCellsPerRange)));
  const double cell = (last - first) / inner;
  cellsPerValue = float(1.0 / cell);
  cellOfZero = float(1.0 - first / cell);  // after the cell that goes on downward
  lastCell = float(inner + 1);

  const auto valueAt = [&](double x) { return partition.denormalised(first + (x - 1.0) * cell); };
  const auto extinctionAt = [&](double x) { return base.extinction(valueAt(x)) * scale * cell; };
  std::vector<std::vector<Piece>> lists(std::size_t(inner) + 2);
  auto point = points.begin();
  double total = 0.0, greatest = 0.0;
  for (const OpacityPoint& p : base.opacityPoints()) {
    greatest = std::max(greatest, base.extinction(p.value) * scale * cell);
  }
  for (int i = 1; i <= inner; ++i) {
    std::vector<Piece>& mine = lists[std::size_t(i)];
    double from = i;
    while (point != points.end() && (*point - first) / cell + 1.0 <= i) ++point;
    for (; point != points.end() && (*point - first) / cell + 1.0 < i + 1.0; ++point) {
      const double to = (*point - first) / cell + 1.0;
      if (to > from) appendPieces(mine, from, to, kPieceTolerance * greatest, extinctionAt);
      from = to;
    }
    appendPieces(mine, from, i + 1.0, kPieceTolerance * greatest, extinctionAt);
    mine = merged(std::move(mine), kCellTolerance * greatest);
    pieces = pieces || mine.size() > 1;
    for (const Piece& piece : mine) total += piece.integral();
  }
  const double below = extinctionAt(0.5), above = extinctionAt(inner + 1.5);
  lists.front() = {{0.0, 1.0, below, below}};
  lists.back() = {{inner + 1.0, inner + 2.0, above, above}};

  const double quantum = std::exp2(std::ceil(std::log2(std::max(total, 1e-30))) - 24.0);
  const auto rounded = [&](double s) { return std::round(s / quantum) * quantum; };
  const auto texel = [&](const Piece& piece, double s) {
    // Where S is rounded, so is the piece's own mean.
    const double width = piece.to - piece.from;
    const double off = (rounded(s + piece.integral()) - rounded(s) - piece.integral()) / width;
    const double half = 0.5 * (piece.end - piece.start) / width;
    return glm::vec4(rounded(s), piece.start + off, half, 0.0);
  };
  double integral = -below;
  glm::dvec3 light = -below * base.color(valueAt(1.0));
  std::vector<glm::vec4> further;
  for (int i = 0; i <= inner + 1; ++i) {
    const glm::dvec3 color = base.color(valueAt(std::max(i, 1)));
    const glm::dvec3 nextColor = base.color(valueAt(std::clamp(i + 1, 1, inner + 1)));
    colors.insert(colors.end(), {glm::vec4(light, rounded(integral)), glm::vec4(color, 0.0)});
    const glm::dvec3 change = glm::abs(nextColor - color);
    colorRate = std::max({colorRate, float(change.r), float(change.g), float(change.b)});
    glm::vec4* link = nullptr;
    for (const Piece& piece : lists[std::size_t(i)]) {
      if (link == nullptr) {
        cells.push_back(texel(piece, integral));
        link = &cells.back();
      } else {
        const auto place = float(std::size_t(inner) + 2 + further.size());
        (link == &cells.back() ? link->w : link->y) = place;
        further.push_back({piece.from - i, 0.0, 0.0, 0.0});
        further.push_back(texel(piece, integral));
        link = &further[further.size() - 2];
      }
      const double middle = 0.5 * (piece.from + piece.to) - i;
      light += piece.integral() * glm::mix(color, nextColor, middle);
      integral += piece.integral();
    }
  }
  colors.resize(colors.size() + 2, colors.back());  // the last cell's end
  cells.insert(cells.end(), further.begin(), further.end());
}

std::pair<glm::vec4, float> PreintegratedTable::pieceAt(float value) const {
  const float x = value * cellsPerValue + cellOfZero;
  const float cell = std::floor(std::clamp(x, 0.0f, lastCell));
  float u = x - cell, from = 0.0f;
  glm::vec4 t = cells[std::size_t(cell)];
  for (auto next = std::size_t(t.w); next > 0;) {
    const glm::vec4& piece = cells[next];
    if (u < piece.x) break;
    from = piece.x;
    t = cells[next + 1];
    next = std::size_t(piece.y);
  }
  return {t, u - from};
}

float PreintegratedTable::integral(float value) const {
  const auto [t, u] = pieceAt(value);
  return t.x + u * (t.y + u * t.z);
}

bool PreintegratedTable::transparent(float low, float high) const {
  // Where both integrals are the same number there may still be a little between them.
  const auto clear = [this](float value) {
    const auto [t, u] = pieceAt(value);
    return t.y + 2.0f * u * t.z == 0.0f;
  };
  return clear(low) && clear(high) && integral(low) == integral(high);
}

}  // namespace vestige
