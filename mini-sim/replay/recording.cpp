// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/replay/recording.h"

#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkPointData.h>
#include <vtkRectilinearGrid.h>

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>

#include "mini-sim/replay/data_set_reader.h"
#include "proxy/base/json_object.h"

namespace minisim {
namespace {

constexpr char kCalls[] = "calls.jsonl";
constexpr char kMask[] = "vestige:mask";

std::string readText(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error("'" + file.string() + "' cannot be read");
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

int locationOf(const nlohmann::json& name) { return name == "cell" ? VESTIGE_CELL : VESTIGE_POINT; }

vtkDataArray* arrayOf(vtkDataSet* data, int location, const std::string& name) {
  vtkDataSetAttributes* attributes = location == VESTIGE_CELL
                                         ? static_cast<vtkDataSetAttributes*>(data->GetCellData())
                                         : static_cast<vtkDataSetAttributes*>(data->GetPointData());
  vtkDataArray* array = attributes->GetArray(name.c_str());
  if (!array || vestigeType(array) < 0)
    throw std::runtime_error("the recording names an array '" + name + "' that its file lacks");
  return array;
}

void replayBlock(const std::filesystem::path& folder, const nlohmann::json& block,
                 Session& session) {
  vestige_grid grid = VESTIGE_GRID_INIT;
  for (int axis = 0; axis < 3; ++axis) {
    grid.points[axis] = block.at("points").at(axis);
    grid.first[axis] = block.at("first").at(axis);
    grid.origin[axis] = block.at("origin").at(axis);
    grid.spacing[axis] = block.at("spacing").at(axis);
  }
  for (int side = 0; side < 6; ++side) grid.ghosts[side] = block.at("ghosts").at(side);
  const int index = block.at("index");
  const std::string file = block.at("file");
  if (file.empty()) return session.block(index, grid);

  const auto data = readDataSet(folder / file, std::nullopt);
  if (auto* rectilinear = vtkRectilinearGrid::SafeDownCast(data)) {
    vtkDataArray* axes[] = {rectilinear->GetXCoordinates(), rectilinear->GetYCoordinates(),
                            rectilinear->GetZCoordinates()};
    for (int axis = 0; axis < 3; ++axis) {
      if (!block.at("axes").at(axis).get<bool>()) continue;
      if (axes[axis]->GetDataType() != VTK_DOUBLE ||
          axes[axis]->GetNumberOfTuples() != grid.points[axis])
        throw std::runtime_error("the coordinates in '" + file + "' do not fit the recorded call");
      grid.axes[axis] = static_cast<const double*>(axes[axis]->GetVoidPointer(0));
    }
  }
  // The pointers we hand out reach as far as the recorded grid says.
  vtkIdType points = 1, cells = 1;
  for (int extent : grid.points) {
    points *= extent;
    cells *= extent > 1 ? extent - 1 : 1;
  }
  if (data->GetNumberOfPoints() != points || data->GetNumberOfCells() != cells)
    throw std::runtime_error("the grid in '" + file + "' does not fit the recorded call");
  session.block(index, grid);
  for (const auto& mask : block.at("masks")) {
    vtkDataArray* array = arrayOf(data, locationOf(mask), kMask);
    if (array->GetDataTypeSize() != 1 || array->GetNumberOfComponents() != 1)
      throw std::runtime_error("the mask in '" + file + "' is not one of bytes");
    session.mask(index, locationOf(mask), array);
  }
  for (const auto& field : block.at("fields")) {
    const int location = locationOf(field.at("location"));
    session.field(index, field.at("name"), location, arrayOf(data, location, field.at("name")));
  }
}

}  // namespace

bool Recording::isOne(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / kCalls);
}

Recording::Recording(std::filesystem::path folder) : folder_(std::move(folder)) {
  config_ = readText(folder_ / "config.toml");
  const std::string text = readText(folder_ / kCalls);
  int line = 0;
  for (std::size_t from = 0; from < text.size();) {
    const auto end = text.find('\n', from);
    if (end == std::string::npos) break;  // torn
    ++line;
    try {
      auto call = vestige::parseJson(std::string_view(text).substr(from, end - from));
      const std::string name = call.at("call");
      if (name == "open") output_ = call.at("output");
      if (name == "execute") executes_.push_back(std::move(call));
    } catch (const std::exception& error) {
      throw std::runtime_error("'" + (folder_ / kCalls).string() + "' line " +
                               std::to_string(line) + ": " + error.what());
    }
    from = end + 1;
  }
}

int Recording::replay(long step, Session& session) const {
  const nlohmann::json& call = executes_.at(std::size_t(step));
  try {
    const std::int64_t cycle = call.at("cycle");
    const double time = call.at("time");
    if (!session.wants(cycle, time)) return session.code();
    if (call.contains("domain")) {
      double corners[6];
      for (int i = 0; i < 6; ++i) corners[i] = call.at("domain").at(i);
      session.domain(corners, corners + 3);
    }
    if (call.contains("units"))
      for (const auto& [name, units] : call.at("units").items()) session.units(name, units);
    for (const auto& block : call.at("blocks")) replayBlock(folder_, block, session);
    return session.execute(cycle, time);
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error("'" + (folder_ / kCalls).string() + "', execute " +
                             std::to_string(step) + ": " + error.what());
  }
}

}  // namespace minisim
