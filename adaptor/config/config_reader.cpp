// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/config/config_reader.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "proxy/base/json_object.h"
#include "proxy/base/nearest_word.h"

namespace vestige {
namespace {

/// Null for dates and times, which JSON has no word for.
nlohmann::json jsonOf(const toml::node& node) {
  if (const auto* table = node.as_table()) {
    nlohmann::json object = nlohmann::json::object();
    for (const auto& [key, value] : *table) object[std::string(key.str())] = jsonOf(value);
    return object;
  }
  if (const auto* array = node.as_array()) {
    nlohmann::json list = nlohmann::json::array();
    for (const auto& element : *array) list.push_back(jsonOf(element));
    return list;
  }
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* number = node.as_integer()) return number->get();
  if (const auto* number = node.as_floating_point()) return number->get();
  if (const auto* truth = node.as_boolean()) return truth->get();
  return nullptr;
}

}  // namespace

ConfigDocument::ConfigDocument(const std::string& text, const std::string& origin)
    : origin_(origin) {
  try {
    table_ = std::make_unique<toml::table>(toml::parse(text));
  } catch (const toml::parse_error& error) {
    throw Error(ErrorCode::Config,
                fmt::format("{}:{}: {}", origin, error.source().begin.line, error.description()));
  }
}
ConfigDocument::~ConfigDocument() = default;
ConfigReader ConfigDocument::root() const { return {*table_, origin_, ""}; }

ConfigReader::ConfigReader(const toml::table& table, std::string origin, std::string path)
    : table_(&table), origin_(std::move(origin)), path_(std::move(path)) {}

bool ConfigReader::has(const std::string& key) const {
  known_.insert(key);
  return table_->contains(key);
}

const toml::node* ConfigReader::find(const std::string& key) {
  known_.insert(key);
  return table_->get(key);
}

void ConfigReader::fail(const std::string& key, const std::string& what) const {
  const toml::node* node = table_->get(key);
  const auto line = (node ? node->source() : table_->source()).begin.line;
  throw Error(ErrorCode::Config, fmt::format("{}:{}: {}{}{}: {}", origin_, line, path_,
                                             path_.empty() ? "" : " ", key, what));
}

void ConfigReader::failType(const std::string& key, const std::string& expected) const {
  std::string kind;
  switch (table_->get(key)->type()) {
    case toml::node_type::table:
      kind = "a table";
      break;
    case toml::node_type::array:
      kind = "an array";
      break;
    case toml::node_type::string:
      kind = "a string";
      break;
    case toml::node_type::integer:
      kind = "an integer";
      break;
    case toml::node_type::floating_point:
      kind = "a number";
      break;
    case toml::node_type::boolean:
      kind = "true or false";
      break;
    default:
      kind = "a date or time";
      break;
  }
  fail(key, fmt::format("expected {}, found {}", expected, kind));
}

void ConfigReader::read(const std::string& key, bool& value) {
  const auto* node = find(key);
  if (!node) return;
  if (!node->is_boolean()) failType(key, "true or false");
  value = node->as_boolean()->get();
}

void ConfigReader::read(const std::string& key, std::string& value) {
  const auto* node = find(key);
  if (!node) return;
  if (!node->is_string()) failType(key, "a string");
  value = node->as_string()->get();
}

void ConfigReader::read(const std::string& key, std::optional<std::string>& value) {
  std::string text;
  read(key, text);
  if (has(key)) value = text;
}

void ConfigReader::readInteger(const std::string& key, long low, long high, long& value) {
  const auto* node = find(key);
  if (!node) return;
  if (!node->is_integer()) failType(key, "an integer");
  const long read = node->as_integer()->get();
  if (read < low || read > high) fail(key, fmt::format("{} is not in {}..{}", read, low, high));
  value = read;
}

void ConfigReader::readInteger(const std::string& key, int low, int high, int& value) {
  long wide = value;
  readInteger(key, long(low), long(high), wide);
  value = int(wide);
}

void ConfigReader::readNumber(const std::string& key, double& value) {
  const auto* node = find(key);
  if (!node) return;
  const auto number = node->value<double>();
  if (!node->is_number() || !number) failType(key, "a number");
  if (!std::isfinite(*number)) fail(key, fmt::format("{} is not a finite number", *number));
  value = *number;
}

void ConfigReader::readNumber(const std::string& key, std::optional<double>& value) {
  double number = 0.0;
  readNumber(key, number);
  if (has(key)) value = number;
}

void ConfigReader::readPositive(const std::string& key, double& value, bool zeroToo) {
  readNumber(key, value);
  if (has(key) && !(value > 0.0 || (zeroToo && value == 0.0))) {
    fail(key, fmt::format("{} is not {}", value, zeroToo ? "0 or positive" : "positive"));
  }
}

void ConfigReader::readBytes(const std::string& key, std::optional<std::uint64_t>& value) {
  if (!has(key)) return;
  double bytes = 0.0;
  std::string text;
  if (isString(key)) {
    static const std::vector<std::pair<std::string, double>> units{
        {"B", 1.0},      {"kB", 1e3},     {"MB", 1e6},     {"GB", 1e9},    {"TB", 1e12},
        {"KiB", 0x1p10}, {"MiB", 0x1p20}, {"GiB", 0x1p30}, {"TiB", 0x1p40}};
    read(key, text);
    const char* last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), last, bytes);
    if (error != std::errc()) {
      fail(key, fmt::format("\"{}\" does not begin with a number, as in \"20 MB\"", text));
    }
    std::string unit(end, last);
    unit.erase(0, std::min(unit.find_first_not_of(' '), unit.size()));
    const auto known = std::find_if(units.begin(), units.end(),
                                    [&](const auto& each) { return each.first == unit; });
    if (known == units.end()) {
      fail(key,
           fmt::format("\"{}\" has no unit that is known: B, kB, MB, GB, TB, KiB, MiB, GiB, TiB",
                       text));
    }
    bytes *= known->second;
  } else {
    if (!find(key)->is_number()) failType(key, "a number of bytes, or a text such as \"20 MB\"");
    readNumber(key, bytes);
    text = fmt::format("{}", bytes);
  }
  if (!(bytes >= 1.0 && bytes <= 0x1p60)) {
    fail(key, fmt::format("{} is not in 1 .. 2^60 bytes", text));
  }
  value = std::uint64_t(bytes);
}

std::vector<double> ConfigReader::readNumbers(const std::string& key, std::size_t count) {
  std::vector<double> numbers;
  const auto* node = find(key);
  if (!node) return numbers;
  if (!node->is_array()) failType(key, "an array of numbers");
  for (const auto& element : *node->as_array()) {
    const auto number = element.value<double>();
    if (!element.is_number() || !number || !std::isfinite(*number)) {
      fail(key, fmt::format("element {} is not a finite number", numbers.size() + 1));
    }
    numbers.push_back(*number);
  }
  if (count != 0 && numbers.size() != count) {
    fail(key, fmt::format("{} numbers are given, {} needed", numbers.size(), count));
  }
  return numbers;
}

std::vector<std::pair<double, double>> ConfigReader::readPairs(const std::string& key) {
  std::vector<std::pair<double, double>> pairs;
  const auto* node = find(key);
  if (!node) return pairs;
  if (!node->is_array()) failType(key, "an array of [value, value] pairs");
  for (const auto& element : *node->as_array()) {
    const auto* pair = element.as_array();
    const auto first = pair && pair->size() == 2 ? pair->get(0)->value<double>() : std::nullopt;
    const auto second = pair && pair->size() == 2 ? pair->get(1)->value<double>() : std::nullopt;
    if (!first || !second || !pair->get(0)->is_number() || !pair->get(1)->is_number() ||
        !std::isfinite(*first) || !std::isfinite(*second)) {
      fail(key, fmt::format("element {} is not a pair of finite numbers", pairs.size() + 1));
    }
    pairs.emplace_back(*first, *second);
  }
  return pairs;
}

std::vector<std::pair<double, double>> ConfigReader::readRanges(const std::string& key) {
  std::vector<std::pair<double, double>> ranges;
  const auto* node = find(key);
  if (!node) return ranges;
  if (!node->is_array()) failType(key, "an array of numbers and [low, high] pairs");
  const auto number = [](const toml::node* from) {
    return from && from->is_number() ? from->value<double>() : std::nullopt;
  };
  for (const auto& element : *node->as_array()) {
    const auto* pair = element.as_array();
    const auto low = number(pair ? pair->get(0) : &element);
    const auto high = pair ? number(pair->get(1)) : low;
    if (!low || !high || std::isnan(*low) || std::isnan(*high) || (pair && pair->size() != 2)) {
      fail(key,
           fmt::format("element {} is neither a number nor a [low, high] pair", ranges.size() + 1));
    }
    if (*low > *high) fail(key, fmt::format("[{}, {}] is upside down", *low, *high));
    ranges.emplace_back(*low, *high);
  }
  return ranges;
}

std::vector<std::string> ConfigReader::readStrings(const std::string& key) {
  std::vector<std::string> strings;
  const auto* node = find(key);
  if (!node) return strings;
  if (!node->is_array()) failType(key, "an array of strings");
  for (const auto& element : *node->as_array()) {
    if (!element.is_string()) {
      fail(key, fmt::format("element {} is not a string", strings.size() + 1));
    }
    strings.push_back(element.as_string()->get());
  }
  return strings;
}

std::size_t ConfigReader::readChoice(const std::string& key,
                                     const std::vector<std::string>& choices, std::size_t value) {
  std::string text;
  read(key, text);
  if (!has(key)) return value;
  const auto found = std::find(choices.begin(), choices.end(), text);
  if (found == choices.end()) {
    fail(key, fmt::format("\"{}\" is none of \"{}\"{}", text, fmt::join(choices, "\", \""),
                          didYouMean(text, choices)));
  }
  return std::size_t(found - choices.begin());
}

bool ConfigReader::isString(const std::string& key) const {
  known_.insert(key);
  const auto* node = table_->get(key);
  return node && node->is_string();
}

std::optional<ConfigReader> ConfigReader::table(const std::string& key) {
  const auto* node = find(key);
  if (!node) return std::nullopt;
  if (!node->is_table()) failType(key, "a table");
  const auto inner = path_.empty() ? "[" + key + "]" : path_ + " " + key;
  return ConfigReader(*node->as_table(), origin_, inner);
}

std::vector<ConfigReader> ConfigReader::tables(const std::string& key) {
  std::vector<ConfigReader> tables;
  const auto* node = find(key);
  if (!node) return tables;
  if (!node->is_array_of_tables()) failType(key, "tables, each headed [[" + key + "]]");
  for (const auto& element : *node->as_array()) {
    tables.emplace_back(*element.as_table(), origin_, "[[" + key + "]]");
  }
  return tables;
}

nlohmann::json ConfigReader::json() const {
  for (const auto& [key, value] : *table_) known_.insert(std::string(key.str()));
  return jsonOf(*table_);
}

void ConfigReader::atKeyLines(const std::function<void()>& read) const {
  try {
    read();
  } catch (const KeyError& error) {
    const auto view = toml::at_path(*table_, error.path());
    const auto line = (view ? view.node()->source() : table_->source()).begin.line;
    throw Error(ErrorCode::Config,
                fmt::format("{}:{}: {}{}{}: {}", origin_, line, path_, path_.empty() ? "" : " ",
                            error.path(), error.reason()));
  }
}

void ConfigReader::rejectUnknownKeys() const {
  const std::vector<std::string> known(known_.begin(), known_.end());
  for (const auto& [key, node] : *table_) {
    const std::string name(key.str());
    if (known_.contains(name)) continue;
    const auto near = nearestWord(name, known);
    fail(name, near.empty() ? fmt::format("unknown key; known are {}", fmt::join(known, ", "))
                            : fmt::format("unknown key; did you mean {}?", near));
  }
}

}  // namespace vestige
