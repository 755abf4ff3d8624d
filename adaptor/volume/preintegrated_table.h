// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec4.hpp>
#include <utility>
#include <vector>

#include "proxy/transfer/interval_partition.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// The base transfer function over normalised values, as march_base.glsl reads it: even cells, and
/// where a cell is too coarse for the function's points in it, a piece from each to the next.
/// Extinction is linear in a cell or piece with the function's own mean, so optical depth between
/// any two of their ends is the function's, however narrow its spikes.
struct PreintegratedTable {
  float cellsPerValue = 1.0f, cellOfZero = 0.0f, lastCell = 1.0f;
  /// Per cell: (S = ∫ extinction up to it, extinction * cell, half its rise in a cell, texel of the
  /// next piece or 0); extinction is per local unit. The first and the last cell go on for ever.
  /// After the cells, per further piece: (where in the cell it starts, texel of the next or 0), and
  /// the same as for a cell. Values of S at all starts are multiples of one power of two: their
  /// differences are exact.
  std::vector<glm::vec4> cells;
  /// Two per cell: (∫ extinction * colour up to it, S), colour at its start.
  std::vector<glm::vec4> colors;
  bool pieces = false;     ///< some cell has more than one
  float colorRate = 0.0f;  ///< greatest change of a colour's component in a cell

  /// `scale` = world units in a local one.
  PreintegratedTable(const TransferFunction& base, const IntervalPartition& partition,
                     double scale);
  /// ∫ extinction up to a normalised value.
  float integral(float value) const;
  /// Nothing between two values, ends included, has any extinction.
  bool transparent(float low, float high) const;

 private:
  /// The cell or piece of a normalised value, and the place in it.
  std::pair<glm::vec4, float> pieceAt(float value) const;
};

}  // namespace vestige
