// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/replay/session.h"

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>

#include <stdexcept>
#include <string_view>
#include <utility>

#include "adaptor/include/vestige_vtk.h"
#include "proxy/base/nearest_word.h"

namespace minisim {
int vestigeType(vtkDataArray* array) {
  return array->HasStandardMemoryLayout() ? vestige::VtkImport::typeOf(array->GetDataType()) : -1;
}

Session::Session(const Options& options) : options_(options) {
  vestige_options open = VESTIGE_OPTIONS_INIT;
  const auto orNull = [](const std::string& text) { return text.empty() ? nullptr : text.c_str(); };
  open.config = orNull(options_.config);
  open.config_text = open.config ? nullptr : orNull(options_.configText);
  open.output = orNull(options_.output);
  open.log_data = this;
  open.log = [](int level, const char* sentence, void* self) {
    // Errors come as codes; of what is only said, the figures of a dry run are its result.
    Session& session = *static_cast<Session*>(self);
    const std::string_view text(sentence);
    const bool info = level == VESTIGE_INFO;
    if (info && text.find(" writes nothing (dry run) ") != text.npos) session.dryRun_ = true;
    if (level == VESTIGE_WARNING || (info && text.starts_with("dry run")))
      session.options_.warn(sentence);
  };
  note(vestige_open(&open, &vestige_));
  import_ = std::make_unique<vestige::VtkImport>(vestige_);
}

Session::~Session() { vestige_close(vestige_); }

std::string Session::lastError() const {
  return std::string(vestige_last_error(vestige_)) + " (" +
         vestige_code_name(code_ != VESTIGE_OK ? code_ : lastCode_) + ")";
}

void Session::domain(const double low[3], const double high[3]) {
  note(vestige_domain(vestige_, low, high));
}

void Session::units(const std::string& name, const std::string& units) {
  note(vestige_units(vestige_, name.c_str(), units.c_str()));
}

void Session::block(int block, const vestige_grid& grid) {
  note(vestige_block(vestige_, block, &grid));
}

void Session::field(int block, const std::string& name, int location, vtkDataArray* array) {
  shared_.emplace_back(array);
  note(vestige_share_field(vestige_, block, name.c_str(), vestigeType(array), location,
                           array->GetNumberOfComponents(), array->GetVoidPointer(0), nullptr));
}

void Session::mask(int block, int location, vtkDataArray* array) {
  shared_.emplace_back(array);
  note(vestige_share_mask(vestige_, block, location,
                          static_cast<const std::uint8_t*>(array->GetVoidPointer(0)), 0xff,
                          nullptr));
}

int Session::execute(std::int64_t cycle, double time) {
  note(vestige_execute(vestige_, cycle, time));
  shared_.clear();
  import_->release();
  return lastCode_ = std::exchange(code_, int(VESTIGE_OK));
}

void Session::dataSet(vtkDataSet* data, int resampledPoints) {
  note(import_->share(0, data, resampledPoints));
}

void keepArray(vtkDataSet* data, const std::string& array) {
  const auto attributes = {static_cast<vtkDataSetAttributes*>(data->GetPointData()),
                           static_cast<vtkDataSetAttributes*>(data->GetCellData())};
  bool found = false;
  std::vector<std::string> others;
  for (vtkDataSetAttributes* set : attributes)
    for (int i = 0; i < set->GetNumberOfArrays(); ++i) {
      const std::string name = set->GetArrayName(i) ? set->GetArrayName(i) : "";
      // VTK's own arrays say which points are ghosts or hidden.
      if (name == array)
        found = true;
      else if (!name.empty() && !name.starts_with("vtk"))
        others.push_back(name);
    }
  if (!found) {
    std::string sentence = "no array '" + array + "'; there are:";
    for (const std::string& name : others) sentence += " " + name;
    throw std::runtime_error(sentence + vestige::didYouMean(array, others));
  }
  for (vtkDataSetAttributes* set : attributes)
    for (const std::string& name : others) set->RemoveArray(name.c_str());
}

}  // namespace minisim
