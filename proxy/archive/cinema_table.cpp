// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "proxy/archive/archive.h"
#include "proxy/archive/archive_paths.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

constexpr std::string_view kHeader = "time,cycle,view,field,proxy,FILE_exr,FILE\n";
constexpr std::size_t kColumns = 7;

/// Spec D types a column by its cells: a time without a point would make it an integer column.
std::string floatText(double value) {
  std::array<char, 32> buffer;
  auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  std::string text(buffer.data(), end);
  if (text.find('.') == std::string::npos) text.insert(std::min(text.find('e'), text.size()), ".0");
  return text;
}

template <typename Number>
bool parse(std::string_view text, Number& value) {
  auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

/// The beginning of a cell, for a message.
std::string_view excerpt(std::string_view cell) { return cell.substr(0, 80); }

[[noreturn]] void damaged(std::size_t line, const std::string& reason) {
  throw Error(ErrorCode::Format, fmt::format("line {} of {}: {}", line, kTableName, reason));
}

std::array<std::string_view, kColumns> cellsOf(std::string_view line, std::size_t number) {
  std::array<std::string_view, kColumns> cells;
  std::size_t count = 0;
  for (std::size_t at = 0; at <= line.size();) {
    std::size_t end = std::min(line.find(',', at), line.size());
    if (count < kColumns) cells[count] = line.substr(at, end - at);
    ++count;
    at = end + 1;
  }
  if (count != kColumns) damaged(number, fmt::format("{} cells, not {}", count, kColumns));
  return cells;
}

ArchiveRow rowFrom(std::string_view line, std::size_t number) {
  auto cells = cellsOf(line, number);
  ArchiveRow row;
  if (!parse(cells[0], row.time) || !std::isfinite(row.time) ||
      cells[0].find('.') == std::string_view::npos)
    damaged(number, fmt::format("time '{}' is no number with a point", excerpt(cells[0])));
  if (!parse(cells[1], row.cycle) || row.cycle < 0)
    damaged(number, fmt::format("cycle '{}' is no number >= 0", excerpt(cells[1])));
  row.view = cells[2], row.field = cells[3], row.proxy = cells[4];
  row.exr = cells[5], row.png = cells[6];
  try {
    validateName("view", row.view);
    validateName("field", row.field);
    validateName("proxy", row.proxy);
  } catch (const Error& e) {
    damaged(number, e.what());
  }
  for (const std::string* path : {&row.exr, &row.png})
    if (!staysInside(*path) || path->find('"') != std::string::npos)
      damaged(number, fmt::format("file '{}' does not lie inside the archive", excerpt(*path)));
  return row;
}

}  // namespace

void validateName(const char* what, const std::string& name) {
  auto refuse = [&](const char* reason) {
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("{} name '{}' cannot be in a Cinema table: {}", what, excerpt(name), reason));
  };
  constexpr std::size_t kLongest = 255;
  if (name.empty()) refuse("it is empty");
  if (name.size() > kLongest) refuse("it is longer than 255 bytes");
  if (name.front() == ' ' || name.back() == ' ') refuse("it begins or ends with a space");
  for (unsigned char c : name) {
    if (c == ',' || c == '"') refuse("it has a comma or a quote");
    if (c < 0x20 || c == 0x7f) refuse("it has a control character");
  }
  double number;
  std::string_view digits(name);
  if (digits.front() == '+') digits.remove_prefix(1);
  if (parse(digits, number)) refuse("it reads as a number");
}

std::string tableHeaderLine() { return std::string(kHeader); }

std::string tableLine(const ArchiveRow& row) {
  return fmt::format("{},{},{},{},{},{},{}\n", floatText(row.time), row.cycle, row.view, row.field,
                     row.proxy, row.exr, row.png);
}

std::string tableText(const std::vector<ArchiveRow>& rows) {
  std::string text(kHeader);
  for (const ArchiveRow& row : rows) text += tableLine(row);
  return text;
}

std::vector<ArchiveRow> rowsFromTable(std::string_view text, bool& tornLastLine) {
  // What follows the last line break is a line that was cut off while it was written.
  std::size_t whole = text.rfind('\n') + 1;  // npos + 1 = 0
  tornLastLine = whole != text.size() || text.empty();
  if (whole == 0) {
    if (!kHeader.starts_with(text)) damaged(1, "it is not the header of an archive");
    return {};
  }
  text = text.substr(0, whole);
  if (!text.starts_with(kHeader))
    damaged(1, fmt::format("the header is not '{}'", kHeader.substr(0, kHeader.size() - 1)));
  text.remove_prefix(kHeader.size());
  std::vector<ArchiveRow> rows;
  for (std::size_t number = 2; !text.empty(); ++number) {
    std::size_t end = text.find('\n');
    rows.push_back(rowFrom(text.substr(0, end), number));
    text.remove_prefix(end + 1);
  }
  return rows;
}

}  // namespace vestige
