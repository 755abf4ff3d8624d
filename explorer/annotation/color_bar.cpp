// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/annotation/color_bar.h"

#include <algorithm>
#include <cmath>

#include "explorer/annotation/ticks.h"

namespace vestige {
namespace {

/// What the plates at the right of a picture have in common: a column of lines that end at its
/// right edge. Lengths in pixels.
struct Column {
  const Picture& picture;
  double unit;  ///< height of letters
  Font font;

  explicit Column(const Picture& of)
      : picture(of), unit(letterHeight(of.size)), font(int(std::lround(unit))) {}
  double padding() const { return 0.5 * unit; }
  double line() const { return 1.35 * unit; }
  double right() const { return picture.size.width - 0.5 * unit - padding(); }
  /// The widest that text may be.
  double room() const { return std::max(0.5 * picture.size.width - 2.0 * padding(), 4.0 * unit); }

  /// A plate behind [right() - width, right()] x [top, top + height].
  void drawPlate(Picture& onto, double width, double top, double height, const Ink& ink) const {
    drawBackplate(onto, glm::dvec2(right() - width, top) - padding(),
                  glm::dvec2(right(), top + height) + padding(), 0.4 * unit, ink);
  }
  /// A line of text with its top at `top`, its right end at `end`.
  void drawText(Picture& onto, double end, double top, const std::string& text,
                const Ink& ink) const {
    font.draw(onto, {end - font.width(text), top + 0.5 * (unit + font.digitHeight())}, text,
              ink.ink);
  }
};

/// What stands above a bar, line by line.
std::vector<std::string> titleOf(const AnnotationSubject& subject, const std::string& scale,
                                 const Column& column) {
  const std::string units = subject.units.empty() ? "" : "[" + subject.units + "]";
  std::vector<std::string> lines;
  const std::string both = subject.field + (units.empty() ? "" : " " + units);
  if (column.font.width(both) <= column.room()) {
    lines.push_back(both);
  } else {
    lines.push_back(shortened(subject.field, column.font, column.room()));
    if (!units.empty()) lines.push_back(shortened(units, column.font, column.room()));
  }
  if (!scale.empty()) lines.push_back(scale);
  return lines;
}

}  // namespace

void drawColorBar(Picture& picture, const AnnotationSubject& subject, const Ink& ink) {
  const TransferFunction& function = *subject.function;
  const Column column(picture);
  const double unit = column.unit, height = std::round(0.5 * picture.size.height);
  if (height < 3.0 * unit) return;
  const double low = function.colorLow(), high = function.colorHigh();
  const Ticks ticks = ticksOf(low, high, std::clamp(int(height / (2.5 * unit)), 2, 6));
  const std::vector<std::string> title = titleOf(subject, ticks.scale, column);

  const double barWidth = std::max(6.0, std::round(0.9 * unit)), tickLength = 0.35 * unit;
  double width = barWidth, titleWidth = 0.0;
  for (const Tick& tick : ticks.ticks)
    width = std::max(width, barWidth + 1.7 * tickLength + column.font.width(tick.text));
  for (const std::string& line : title) titleWidth = std::max(titleWidth, column.font.width(line));
  // Two plates, so that a long title hides no more of the picture than it must.
  const double titleHeight = column.line() * double(title.size());
  const double apart = 2.0 * column.padding() + 0.5 * unit;
  const double plateTop =
      std::max(0.5 * (picture.size.height - height - titleHeight - apart), column.padding());
  column.drawPlate(picture, titleWidth, plateTop, titleHeight, ink);
  column.drawPlate(picture, width, plateTop + titleHeight + apart, height, ink);
  for (std::size_t i = 0; i < title.size(); ++i)
    column.drawText(picture, column.right(), plateTop + column.line() * (double(i) + 0.13),
                    title[i], ink);

  const double x1 = std::round(column.right()), x0 = x1 - barWidth;
  const double top = std::round(plateTop + titleHeight + apart), bottom = top + height;
  for (int y = 0; y < int(height); ++y) {
    const double value = high + (low - high) * (y + 0.5) / height;
    drawPlate(picture, {x0, top + y}, {x1, top + y + 1.0}, 0.0, function.color(value), 1.0);
  }
  const glm::dvec2 corners[] = {{x0, top}, {x1, top}, {x1, bottom}, {x0, bottom}, {x0, top}};
  const double rim = std::max(1.0, unit / 16.0);
  for (int i = 0; i < 4; ++i) drawLine(picture, corners[i], corners[i + 1], rim, ink.ink);
  for (const Tick& tick : ticks.ticks) {
    const double y = bottom + (top - bottom) * (tick.value - low) / (high - low);
    drawLine(picture, {x0 - tickLength, y}, {x0, y}, rim, ink.ink);
    column.drawText(picture, x0 - 1.7 * tickLength, y - 0.5 * unit, tick.text, ink);
  }
}

void drawLegend(Picture& picture, const AnnotationSubject& subject, const Ink& ink) {
  if (subject.legend.empty()) return;
  const Column column(picture);
  const double unit = column.unit, side = std::round(unit), line = 1.6 * unit;
  const double most = picture.size.height - 2.0 * column.padding() - unit;
  const std::size_t count =
      std::min(subject.legend.size(), std::size_t(std::max(most / line, 0.0)));
  std::vector<std::string> names;
  double width = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    names.push_back(shortened(subject.legend[i].name, column.font, column.room() - 1.6 * unit));
    width = std::max(width, side + 0.6 * unit + column.font.width(names.back()));
  }
  if (count == 0) return;
  const double height = line * double(count) - 0.6 * unit;
  double y = std::max(0.22 * picture.size.height, column.padding() + 0.5 * unit);
  y = std::min(y, picture.size.height - column.padding() - 0.5 * unit - height);
  column.drawPlate(picture, width, y, height, ink);
  for (std::size_t i = 0; i < count; ++i, y += line) {
    const glm::dvec2 low(column.right() - side, y);
    drawPlate(picture, low, low + side, 0.15 * unit, subject.legend[i].color,
              std::max(subject.legend[i].opacity, 0.25));
    column.drawText(picture, column.right() - side - 0.6 * unit, y, names[i], ink);
  }
}

}  // namespace vestige
