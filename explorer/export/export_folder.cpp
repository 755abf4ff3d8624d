// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export/export_folder.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "proxy/archive/archive.h"
#include "proxy/archive/archive_paths.h"
#include "proxy/base/durable_file.h"
#include "proxy/base/error.h"
#include "proxy/base/json_object.h"

namespace vestige {
namespace {

constexpr char kManifest[] = "manifest.json";

bool isArchive(const std::filesystem::path& folder) try {
  return !Archive(folder).rows().empty();
} catch (const Error&) {  // some other table
  return false;
}

void refuseArchive(const std::filesystem::path& folder) {
  std::error_code error;
  auto around = std::filesystem::weakly_canonical(folder, error);
  for (; !error && around.has_relative_path(); around = around.parent_path()) {
    std::error_code ignored;
    if (!std::filesystem::exists(around / kTableName, ignored) || !isArchive(around)) continue;
    throw Error(ErrorCode::Exists, "'" + folder.string() + "' lies in the archive '" +
                                       around.string() + "': export to another folder");
  }
}

/// The files that an earlier export wrote; none where its manifest is missing or not one.
std::set<std::string> filesOf(const std::filesystem::path& manifest) try {
  std::error_code ignored;
  if (!std::filesystem::exists(manifest, ignored)) return {};
  const std::vector<std::byte> bytes = readBytes(manifest, std::size_t(64) << 20);
  const nlohmann::json listed =
      parseJson({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  std::set<std::string> files{kManifest};
  listed.at("archive").get<std::string>();
  for (const auto& entry : listed.at("files")) files.insert(entry.at("file").get<std::string>());
  return files;
} catch (const std::exception&) {
  return {};
}

}  // namespace

ExportFolder::ExportFolder(std::filesystem::path folder) : folder_(std::move(folder)) {
  refuseArchive(folder_);
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) {
    throw Error(ErrorCode::Io, folder_.string() + " cannot be created: " + error.message());
  }
  ours_ = filesOf(folder_ / kManifest);
  file(kManifest);  // rather before the work than after it
}

std::filesystem::path ExportFolder::file(const std::string& name) const {
  const std::filesystem::path path = folder_ / name;
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !ours_.contains(name)) {
    throw Error(ErrorCode::Exists, "'" + path.string() +
                                       "' is there, and no manifest.json beside it says that an "
                                       "export wrote it: remove it, or export to another folder");
  }
  return path;
}

}  // namespace vestige
