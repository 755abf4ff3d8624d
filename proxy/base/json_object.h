// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proxy/base/error.h"

namespace vestige {

/// The value of a JSON text that may come from anywhere. Throws nlohmann's parse_error with line
/// and column for bad syntax, Format for more than kMostJsonLevels levels (whose reading, printing
/// and freeing would take as much of the stack), for a key that an object gives twice and for
/// numbers that no double holds.
nlohmann::json parseJson(std::string_view text);
inline constexpr int kMostJsonLevels = 64;

/// A Config error of one key, so that who knows the file can say the line.
class KeyError : public Error {
 public:
  /// `path` as "primitives[1].width".
  KeyError(const std::string& owner, std::string path, std::string reason)
      : Error(ErrorCode::Config, owner + " key '" + path + "' " + reason),
        path_(std::move(path)),
        reason_(std::move(reason)) {}
  const std::string& path() const { return path_; }
  const std::string& reason() const { return reason_; }

 private:
  std::string path_, reason_;
};

/// Reads the keys of one JSON object and complains of what is left over: unknown keys and wrong
/// types are KeyErrors that name the key by its path ("ao.radius").
class JsonObject {
 public:
  /// `owner` is what errors call the whole: "look key 'ao.radius' ...".
  JsonObject(const nlohmann::json& object, std::string path, std::string owner = "look");

  /// The value of a key or nullptr where absent; marks it as known.
  const nlohmann::json* find(const char* key);
  void read(const char* key, double& value);
  void read(const char* key, bool& value);
  void read(const char* key, std::string& value);
  void read(const char* key, std::vector<double>& value);
  /// One of `names`; sets the enumerator at the same position.
  template <typename Enum>
  void readName(const char* key, const std::vector<std::pair<const char*, Enum>>& names,
                Enum& value) {
    const nlohmann::json* found = find(key);
    if (!found) return;
    std::vector<std::string> choices;
    for (const auto& [name, enumerator] : names) {
      if (*found == name) {
        value = enumerator;
        return;
      }
      choices.emplace_back(name);
    }
    failChoice(key, *found, choices);
  }
  /// The objects of a list, each to be read and finished; none where the key is absent.
  std::vector<JsonObject> list(const char* key);
  /// Throws for the first key that nobody asked for.
  void finish() const;
  /// Throws for a value that is none of `choices`; says which is near.
  [[noreturn]] void failChoice(const char* key, const nlohmann::json& value,
                               const std::vector<std::string>& choices) const;
  [[noreturn]] void fail(const std::string& key, const std::string& reason) const;
  std::string pathOf(const std::string& key) const;

 private:
  const nlohmann::json& json_;
  std::string path_, owner_;
  std::vector<std::string> known_;
};

}  // namespace vestige
