// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace toml {
inline namespace v3 {
class node;
class table;
}  // namespace v3
}  // namespace toml

namespace vestige {

/// A table of the configuration. Every read names its key; keys that were not asked for are errors
/// in the end. All errors are Config errors "origin:line: [table] key: what".
class ConfigReader {
 public:
  /// `path` is how errors call the table, e.g. "[image]"; "" for the root.
  ConfigReader(const toml::table& table, std::string origin, std::string path);

  bool has(const std::string& key) const;
  void read(const std::string& key, bool& value);
  void read(const std::string& key, std::string& value);
  void read(const std::string& key, std::optional<std::string>& value);
  void readInteger(const std::string& key, long low, long high, long& value);
  void readInteger(const std::string& key, int low, int high, int& value);
  /// Finite; integers are taken too.
  void readNumber(const std::string& key, double& value);
  void readNumber(const std::string& key, std::optional<double>& value);
  /// A number > 0 (or >= 0).
  void readPositive(const std::string& key, double& value, bool zeroToo = false);
  /// A count of bytes, 1 .. 2^60: a number, or a text with a unit: "20 MB" (10^6), "1.5 GiB"
  /// (2^30).
  void readBytes(const std::string& key, std::optional<std::uint64_t>& value);
  /// A list of numbers; `count` of them unless count is 0.
  std::vector<double> readNumbers(const std::string& key, std::size_t count = 0);
  std::vector<std::pair<double, double>> readPairs(const std::string& key);
  /// A list of numbers and of [low, high] pairs; a number is the pair of itself. Infinite ends are
  /// taken.
  std::vector<std::pair<double, double>> readRanges(const std::string& key);
  std::vector<std::string> readStrings(const std::string& key);
  /// One of `choices`; its index.
  std::size_t readChoice(const std::string& key, const std::vector<std::string>& choices,
                         std::size_t value);
  bool isString(const std::string& key) const;

  /// The table, or the tables of an array of tables; none when the key is missing.
  std::optional<ConfigReader> table(const std::string& key);
  std::vector<ConfigReader> tables(const std::string& key);

  /// The whole table as JSON, for readers that looks share; every key counts as asked for. Throws
  /// where the table holds a date or a time.
  nlohmann::json json() const;
  /// Runs `read`; a KeyError of the JSON is thrown again at the line of its key.
  void atKeyLines(const std::function<void()>& read) const;

  /// Throws if a key of this table was never asked for.
  void rejectUnknownKeys() const;
  /// Throws at the line of `key` (or of the table, if the key is missing).
  [[noreturn]] void fail(const std::string& key, const std::string& what) const;

 private:
  const toml::node* find(const std::string& key);
  [[noreturn]] void failType(const std::string& key, const std::string& expected) const;

  const toml::table* table_;
  std::string origin_;
  std::string path_;
  mutable std::set<std::string> known_;
};

/// A parsed TOML text; must outlive its readers. The only place that knows the TOML library.
class ConfigDocument {
 public:
  /// Throws Config with line and reason when the text is no TOML.
  ConfigDocument(const std::string& text, const std::string& origin);
  ~ConfigDocument();
  ConfigReader root() const;

 private:
  std::string origin_;
  std::unique_ptr<toml::table> table_;
};

}  // namespace vestige
