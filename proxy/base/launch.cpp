// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/base/launch.h"

#include <fmt/format.h>

#include <charconv>

namespace vestige {
namespace {

struct Launcher {
  const char* size;  ///< variable of the number of processes, or nullptr
  const char* rank;
};

// Of steps, not of allocations: SLURM_NTASKS is also set where no srun was.
constexpr Launcher kLaunchers[] = {{"OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"},
                                   {"PMI_SIZE", "PMI_RANK"},
                                   {"MV2_COMM_WORLD_SIZE", "MV2_COMM_WORLD_RANK"},
                                   {"SLURM_STEP_NUM_TASKS", "SLURM_PROCID"},
                                   {"JSM_NAMESPACE_SIZE", "JSM_NAMESPACE_RANK"},
                                   {"FLUX_JOB_SIZE", "FLUX_TASK_RANK"},
                                   {nullptr, "PMIX_RANK"},
                                   {nullptr, "PALS_RANKID"},
                                   {nullptr, "ALPS_APP_PE"}};

std::optional<int> wholeNumber(std::string_view text) {
  int value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc() || end != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

constexpr std::string_view kNote = "process ", kOf = " of ", kAlone = ", alone";

}  // namespace

std::optional<Launch> launchOf(const std::function<const char*(const char*)>& variable) {
  const auto number = [&](const char* name) -> std::optional<int> {
    const char* value = name ? variable(name) : nullptr;
    return value ? wholeNumber(value) : std::nullopt;
  };
  for (const auto& [size, rank] : kLaunchers) {
    const auto count = number(size), mine = number(rank);
    if (count && *count > 1) return Launch{size, mine.value_or(-1), *count};
    if (!size && mine && *mine > 0) return Launch{rank, *mine, 0};
  }
  return std::nullopt;
}

std::string launchNote(const Launch& launch) {
  return fmt::format("{}{}{}{}{}", kNote, launch.rank < 0 ? "?" : std::to_string(launch.rank), kOf,
                     launch.processes > 0 ? std::to_string(launch.processes) : "several", kAlone);
}

std::optional<Launch> launchIn(std::string_view provenance) {
  const auto alone = provenance.find(kAlone);
  if (alone == std::string_view::npos) return std::nullopt;
  const auto begin = provenance.rfind(kNote, alone);
  if (begin == std::string_view::npos) return std::nullopt;
  const auto note = provenance.substr(begin + kNote.size(), alone - begin - kNote.size());
  const auto of = note.find(kOf);
  if (of == std::string_view::npos) return std::nullopt;
  return Launch{{},
                wholeNumber(note.substr(0, of)).value_or(-1),
                wholeNumber(note.substr(of + kOf.size())).value_or(0)};
}

}  // namespace vestige
