// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/volume/customization_pass.h"

#include <algorithm>
#include <deque>
#include <glm/vec4.hpp>
#include <string>
#include <utility>

#include "customization_pass_glsl.embed.h"
#include "proxy/customization/cell_counts.h"
#include "proxy/base/error.h"
#include "proxy/gl/functions.h"
#include "proxy/gl/objects.h"
#include "proxy/gl/program.h"

namespace vestige {
namespace {

constexpr unsigned kLanes = 32;
constexpr int kSlicesAtOnce = 8;  ///< no dispatch takes long: drivers end those that do

/// Cells as the shader reads them; what is in each vector it says.
struct CellBuffers {
  std::vector<glm::ivec4> cells, slices, runs;
  std::vector<int> starts;

  explicit CellBuffers(const CellCounts& counts) : metric_(counts.metric()) {
    for (const CellCounts::Cell& cell : counts.cells()) {
      const int first = int(slices.size() / 2);
      // Runs of a cell are sorted by z, then y.
      for (std::size_t i = cell.begin, end = i; i < cell.end; i = end) {
        while (end < cell.end && counts.runs()[end].z == counts.runs()[i].z) ++end;
        addSlice({counts.runs().begin() + std::ptrdiff_t(i), end - i});
      }
      const bool last = &cell == &counts.cells().back() || (&cell + 1)->seed.row != cell.seed.row;
      cells.emplace_back(cell.seed.node, cell.seed.row);
      cells.emplace_back(first, int(slices.size() / 2), last ? 1 : 0, 0);
    }
  }

 private:
  void addSlice(std::span<const CellCounts::Run> slice) {
    const int firstStart = int(starts.size());
    int greatest = 0;
    for (const CellCounts::Run& run : slice) {
      // The first run of each y; a y of no run starts where the next one does.
      while (slice.front().y + int(starts.size()) - firstStart <= run.y)
        starts.push_back(int(runs.size()));
      runs.emplace_back(run.y, run.first, run.last, 0);
      greatest = std::max({greatest, measured(metric_, run.first) + measured(metric_, run.y),
                           measured(metric_, run.last) + measured(metric_, run.y)});
    }
    starts.push_back(int(runs.size()));
    slices.emplace_back(slice.front().z, slice.front().y, slice.back().y, greatest);
    slices.emplace_back(firstStart, 0, 0, 0);
  }

  SeedMetric metric_;
};

/// Storage buffers at the bindings 0, 1, ...
class Bound {
 public:
  void add(const void* bytes, std::size_t size, GLenum usage) {
    const gl::Functions& f = gl::functions();
    const gl::Buffer& buffer = buffers_.emplace_back();
    f.BindBufferBase(GL_SHADER_STORAGE_BUFFER, GLuint(buffers_.size() - 1), buffer.id());
    f.BufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(size), bytes, usage);
  }
  template <typename T>
  void add(std::span<const T> values) {
    add(values.data(), values.size_bytes(), GL_STATIC_DRAW);
  }
  GLuint id(std::size_t binding) const { return buffers_[binding].id(); }

 private:
  std::deque<gl::Buffer> buffers_;
};

void readBack(GLuint buffer, std::vector<NodeValues>& to) {
  const gl::Functions& f = gl::functions();
  const std::size_t bytes = to.size() * sizeof(NodeValues);
  f.BindBuffer(GL_SHADER_STORAGE_BUFFER, buffer);
  f.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  const void* mapped =
      f.MapBufferRange(GL_SHADER_STORAGE_BUFFER, 0, GLsizeiptr(bytes), GL_MAP_READ_BIT);
  if (!mapped) {
    gl::checkErrors("natural neighbours");
    throw Error(ErrorCode::Gl, "natural neighbours: the result could not be mapped");
  }
  const auto* values = static_cast<const NodeValues*>(mapped);
  std::copy(values, values + to.size(), to.begin());
  f.UnmapBuffer(GL_SHADER_STORAGE_BUFFER);
}

void dispatch(const CellCounts& counts, std::span<const NodeValues> rows,
              std::vector<NodeValues>& result) {
  const gl::Functions& f = gl::functions();
  const CellBuffers cells(counts);
  Bound bound;
  bound.add(nullptr, result.size() * sizeof(NodeValues), GL_STREAM_READ);
  bound.add(std::span<const glm::ivec4>(cells.cells));
  bound.add(std::span<const glm::ivec4>(cells.slices));
  bound.add(std::span<const glm::ivec4>(cells.runs));
  bound.add(rows);
  bound.add(std::span<const int>(cells.starts));
  std::vector<std::pair<std::string, std::string>> defines;
  if (counts.metric() == SeedMetric::Manhattan) defines.emplace_back("MANHATTAN", "");
  const gl::Program program({{GL_COMPUTE_SHADER, embedded::customization_pass_glsl}}, defines);
  program.use();
  const glm::ivec3 nodes = counts.nodes();
  f.Uniform3i(program.uniform("nodes"), nodes.x, nodes.y, nodes.z);
  f.Uniform1i(program.uniform("cellCount"), GLint(counts.cells().size()));
  for (int z = 0; z < nodes.z; z += kSlicesAtOnce) {
    f.Uniform1i(program.uniform("firstZ"), z);
    f.DispatchCompute((GLuint(nodes.x) + kLanes - 1) / kLanes, GLuint(nodes.y),
                      GLuint(std::min(kSlicesAtOnce, nodes.z - z)));
    f.Finish();
  }
  readBack(bound.id(0), result);
  gl::checkErrors("natural neighbours");
}

}  // namespace

std::vector<NodeValues> naturalNeighbours(gl::Device& device, glm::ivec3 nodes,
                                          std::span<const GridSeed> seeds,
                                          std::span<const NodeValues> rows, SeedMetric metric) {
  requireSeeds(nodes, seeds, rows.size());
  const CellCounts counts(nodes, metric, seeds, voronoiRuns(nodes, seeds, metric));
  std::vector<NodeValues> result(std::size_t(nodes.x) * std::size_t(nodes.y) *
                                 std::size_t(nodes.z));
  device.run([&] { dispatch(counts, rows, result); });
  for (const GridSeed& seed : seeds) {
    const glm::ivec3 p = seed.node;
    result[std::size_t((p.z * nodes.y + p.y) * nodes.x + p.x)] = rows[std::size_t(seed.row)];
  }
  return result;
}

CustomVolume customVolume(gl::Device& device, const Customization& customization, const Box& box) {
  const SeedGrid grid = seedGrid(customization, box);
  return {box, grid, naturalNeighbours(device, grid.nodes, grid.seeds, grid.rows, grid.metric)};
}

}  // namespace vestige
