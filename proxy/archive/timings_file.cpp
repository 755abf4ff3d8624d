// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/archive/timings_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <span>
#include <string_view>
#include <variant>

#include "proxy/archive/archive_paths.h"
#include "proxy/base/durable_file.h"
#include "proxy/base/parse_number.h"

namespace vestige {
namespace {

namespace fs = std::filesystem;

std::vector<std::string_view> cellsOf(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find(',', at), line.size());
    cells.push_back(line.substr(at, end - at));
    at = end + 1;
  }
  return cells;
}

std::optional<std::string> textOf(const fs::path& archive) {
  std::error_code failed;
  if (!fs::exists(archive / kTimingsName, failed)) return std::nullopt;
  const std::vector<std::byte> bytes = readBytes(archive / kTimingsName);
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

using Line = std::variant<TimingsFile::Step, TimingsFile::Problem>;

Line lineOf(std::string_view text, int number, const std::vector<std::string_view>& columns) {
  const auto problem = [&](const std::string& what, bool leftover) {
    return TimingsFile::Problem{fmt::format("line {} {}", number, what), leftover};
  };
  const auto cells = cellsOf(text);
  if (cells.size() < columns.size()) return problem("is cut off", true);
  if (cells.size() > columns.size())
    return problem(fmt::format("has {} cells, not {}", cells.size(), columns.size()), false);
  TimingsFile::Step step{number, 0, std::nullopt};
  const char* end = cells[0].data() + cells[0].size();
  const auto [stop, error] = std::from_chars(cells[0].data(), end, step.cycle);
  if (error != std::errc() || stop != end)
    return problem(fmt::format("has the cycle '{}'", cells[0].substr(0, 80)), false);
  if (columns.size() < 2 || columns[1] != "time") return step;
  step.time = parseNumber(cells[1]);
  if (!step.time) return problem(fmt::format("has the time '{}'", cells[1].substr(0, 80)), false);
  return step;
}

/// Calls visit(text, Line) for every line after the first. What is wrong with the first one, if
/// anything is.
template <typename Visit>
std::optional<TimingsFile::Problem> visitLines(std::string_view text, const Visit& visit) {
  std::size_t end = text.find('\n');
  if (end == std::string_view::npos) return TimingsFile::Problem{"its first line is cut off", true};
  const auto columns = cellsOf(text.substr(0, end));
  if (columns.front() != "cycle")
    return TimingsFile::Problem{"its first column is not 'cycle'", false};
  for (int number = 2; !(text = text.substr(end + 1)).empty(); ++number) {
    end = text.find('\n');
    if (end == std::string_view::npos) {
      visit(text, TimingsFile::Problem{fmt::format("line {} is cut off", number), true});
      break;
    }
    visit(text.substr(0, end + 1), lineOf(text.substr(0, end), number, columns));
  }
  return std::nullopt;
}

}  // namespace

TimingsFile readTimings(const fs::path& archive) {
  TimingsFile file;
  const auto text = textOf(archive);
  if (!text) return file;
  const auto wrong = visitLines(*text, [&](std::string_view, const Line& line) {
    if (const auto* step = std::get_if<TimingsFile::Step>(&line))
      file.steps.push_back(*step);
    else
      file.problems.push_back(std::get<TimingsFile::Problem>(line));
  });
  if (wrong) file.problems.push_back(*wrong);
  return file;
}

void keepTimings(const fs::path& archive, const std::function<bool(long)>& wanted) {
  const auto text = textOf(archive);
  if (!text) return;
  std::string kept = text->substr(0, text->find('\n') + 1);
  const auto wrong = visitLines(*text, [&](std::string_view lineText, const Line& line) {
    const auto* step = std::get_if<TimingsFile::Step>(&line);
    if (step && wanted(step->cycle)) kept += lineText;
  });
  if (wrong) {
    std::error_code ignored;
    fs::remove(archive / kTimingsName, ignored);
  } else if (kept != *text) {
    writeDurably(archive / kTimingsName, std::as_bytes(std::span(kept.data(), kept.size())));
  }
}

}  // namespace vestige
