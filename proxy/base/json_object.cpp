// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/base/json_object.h"

#include <algorithm>
#include <set>

#include "proxy/base/nearest_word.h"

namespace vestige {

nlohmann::json parseJson(std::string_view text) try {
  using Event = nlohmann::json::parse_event_t;
  std::vector<std::set<std::string>> open;  // the keys so far of the objects that we are in
  const auto judge = [&](int depth, Event event, nlohmann::json& parsed) {
    if (depth > kMostJsonLevels) {
      throw Error(ErrorCode::Format,
                  "JSON is nested deeper than " + std::to_string(kMostJsonLevels) + " levels");
    }
    if (event == Event::object_start) open.emplace_back();
    if (event == Event::object_end) open.pop_back();
    if (event == Event::key && !open.back().insert(parsed.get<std::string>()).second)
      throw Error(ErrorCode::Format, "JSON gives the key " + parsed.dump() + " twice");
    return true;
  };
  return nlohmann::json::parse(text.begin(), text.end(), judge);
} catch (const nlohmann::json::out_of_range& error) {
  throw Error(ErrorCode::Format, std::string("JSON holds a number out of range: ") + error.what());
}

JsonObject::JsonObject(const nlohmann::json& object, std::string path, std::string owner)
    : json_(object), path_(std::move(path)), owner_(std::move(owner)) {
  if (object.is_object()) return;
  const std::string reason = "must be a JSON object, not " + object.dump();
  if (path_.empty()) throw Error(ErrorCode::Config, "a " + owner_ + " " + reason);
  throw KeyError(owner_, path_, reason);
}

const nlohmann::json* JsonObject::find(const char* key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
  const auto found = json_.find(key);
  return found == json_.end() ? nullptr : &*found;
}

void JsonObject::read(const char* key, double& value) {
  const nlohmann::json* found = find(key);
  if (!found) return;
  if (!found->is_number()) fail(key, "must be a number, not " + found->dump());
  value = found->get<double>();
}

void JsonObject::read(const char* key, bool& value) {
  const nlohmann::json* found = find(key);
  if (!found) return;
  if (!found->is_boolean()) fail(key, "must be true or false, not " + found->dump());
  value = found->get<bool>();
}

void JsonObject::read(const char* key, std::string& value) {
  const nlohmann::json* found = find(key);
  if (!found) return;
  if (!found->is_string()) fail(key, "must be a string, not " + found->dump());
  value = found->get<std::string>();
}

void JsonObject::read(const char* key, std::vector<double>& value) {
  const nlohmann::json* found = find(key);
  if (!found) return;
  const bool numbers =
      found->is_array() &&
      std::all_of(found->begin(), found->end(), [](const auto& v) { return v.is_number(); });
  if (!numbers) fail(key, "must be a list of numbers, not " + found->dump());
  value = found->get<std::vector<double>>();
}

std::vector<JsonObject> JsonObject::list(const char* key) {
  std::vector<JsonObject> objects;
  const nlohmann::json* found = find(key);
  if (!found) return objects;
  if (!found->is_array()) fail(key, "must be a list, not " + found->dump());
  for (const auto& element : *found) {
    objects.emplace_back(element, pathOf(key) + "[" + std::to_string(objects.size()) + "]", owner_);
  }
  return objects;
}

void JsonObject::finish() const {
  for (const auto& [key, value] : json_.items()) {
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    std::string choices;
    for (const std::string& known : known_) choices += (choices.empty() ? "" : ", ") + known;
    fail(key, "is not known here" + didYouMean(key, known_) + "; known: " + choices);
  }
}

void JsonObject::failChoice(const char* key, const nlohmann::json& value,
                            const std::vector<std::string>& choices) const {
  std::string list;
  for (const std::string& choice : choices) list += (list.empty() ? "" : ", ") + choice;
  fail(key, "is " + value.dump() + "; choices: " + list +
                (value.is_string() ? didYouMean(value.get<std::string>(), choices) : ""));
}

void JsonObject::fail(const std::string& key, const std::string& reason) const {
  throw KeyError(owner_, pathOf(key), reason);
}

std::string JsonObject::pathOf(const std::string& key) const {
  return path_.empty() ? key : path_ + "." + key;
}

}  // namespace vestige
