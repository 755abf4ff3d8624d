// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "proxy/error.h"

namespace vestige {

/// Reads the keys of one JSON object and complains of what is left over: unknown keys and wrong
/// types are Config errors that name the key by its path ("ao.radius").
class JsonObject {
 public:
  JsonObject(const nlohmann::json& json, std::string path);

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
    std::string choices;
    for (const auto& [name, enumerator] : names) {
      if (*found == name) {
        value = enumerator;
        return;
      }
      choices += choices.empty() ? name : std::string(", ") + name;
    }
    fail(key, "is " + found->dump() + "; choices: " + choices);
  }
  /// Throws Config for the first key that nobody asked for.
  void finish() const;
  [[noreturn]] void fail(const std::string& key, const std::string& reason) const;
  std::string pathOf(const std::string& key) const;

 private:
  const nlohmann::json& json_;
  std::string path_;
  std::vector<std::string> known_;
};

}  // namespace vestige
