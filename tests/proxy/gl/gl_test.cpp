// SPDX-License-Identifier: BSD-3-Clause
#include <cfenv>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include "proxy/base/error.h"
#include "proxy/gl/device.h"
#include "proxy/gl/functions.h"
#include "proxy/gl/objects.h"
#include "proxy/gl/program.h"
#include "tests/proxy/gl/host_context.h"

namespace vestige::gl {
namespace {

constexpr const char* kTriangle = R"(#version 300 es
void main() {
  vec2 corner = vec2(float((gl_VertexID << 1) & 2), float(gl_VertexID & 2));
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
)";

constexpr const char* kPaint = R"(#version 300 es
precision highp float;
uniform vec4 color;
layout(location = 0) out vec4 outColor;
void main() { outColor = color * SCALE; }
)";

constexpr const char* kSquares = R"(#version 430 core
layout(local_size_x = 8) in;
layout(std430, binding = 0) buffer Values { float values[]; };
void main() {
  float v = values[gl_GlobalInvocationID.x];
  values[gl_GlobalInvocationID.x] = v * v;
}
)";

/// Draws a 4x4 picture of one colour with a GLSL ES 3.00 program and reads it back.
std::vector<float> paint(float r, float g, float b, float a) {
  const Functions& gl = functions();
  Program program({{GL_VERTEX_SHADER, kTriangle}, {GL_FRAGMENT_SHADER, kPaint}},
                  {{"SCALE", "0.5"}});
  Texture target(GL_TEXTURE_2D);
  target.bind(0);
  gl.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, 4, 4);
  Framebuffer framebuffer;
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target.id(), 0);
  EXPECT_EQ(gl.CheckFramebufferStatus(GL_FRAMEBUFFER), GLenum(GL_FRAMEBUFFER_COMPLETE));
  VertexArray vertices;
  gl.BindVertexArray(vertices.id());
  gl.Viewport(0, 0, 4, 4);
  program.use();
  gl.Uniform4f(program.uniform("color"), r, g, b, a);
  gl.DrawArrays(GL_TRIANGLES, 0, 3);
  std::vector<float> pixels(4 * 16);
  gl.ReadPixels(0, 0, 4, 4, GL_RGBA, GL_FLOAT, pixels.data());
  gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
  checkErrors("paint");
  return pixels;
}

std::vector<float> squares(std::vector<float> values) {
  const Functions& gl = functions();
  Program program({{GL_COMPUTE_SHADER, kSquares}});
  Buffer buffer;
  const GLsizeiptr bytes = GLsizeiptr(values.size() * sizeof(float));
  gl.BindBuffer(GL_SHADER_STORAGE_BUFFER, buffer.id());
  gl.BufferData(GL_SHADER_STORAGE_BUFFER, bytes, values.data(), GL_DYNAMIC_COPY);
  gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffer.id());
  program.use();
  gl.DispatchCompute(GLuint(values.size() / 8), 1, 1);
  gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  gl.GetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, bytes, values.data());
  checkErrors("squares");
  return values;
}

/// Both halves of what Vestige asks of a device: compute, and GLSL ES rendering.
void expectWorks(Device& device) {
  device.run([] {
    const auto pixels = paint(1.0f, 0.5f, 0.25f, 2.0f);
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
      EXPECT_EQ(pixels[i], 0.5f);
      EXPECT_EQ(pixels[i + 1], 0.25f);
      EXPECT_EQ(pixels[i + 2], 0.125f);
      EXPECT_EQ(pixels[i + 3], 1.0f);
    }
    std::vector<float> values(1024);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = float(i);
    const auto result = squares(values);
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(result[i], float(i) * float(i));
  });
}

ErrorCode codeOf(const std::function<void()>& work, std::string* sentence = nullptr) {
  try {
    work();
  } catch (const Error& e) {
    if (sentence) *sentence = e.what();
    return e.code();
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorCode::Internal;
}

class GlDevice : public testing::TestWithParam<std::string> {
 protected:
  std::shared_ptr<Device> create(int threads = 0) { return Device::create(GetParam(), threads); }
};

INSTANTIATE_TEST_SUITE_P(Backends, GlDevice, testing::Values("osmesa", "egl"),
                         [](const auto& backend) { return backend.param; });

TEST_P(GlDevice, SaysWhatItIs) {
  const auto device = create(2);
  EXPECT_EQ(device->info().backend, GetParam());
  EXPECT_FALSE(device->info().renderer.empty());
  EXPECT_EQ(device->info().isSoftware(),
            device->info().renderer.find("llvmpipe") != std::string::npos);
  EXPECT_FALSE(device->info().version.empty());
  EXPECT_GE(device->info().maxTexture3D, 256);
}

TEST_P(GlDevice, RendersEsShadersAndComputes) { expectWorks(*create()); }

TEST_P(GlDevice, RunsOnItsOwnThreadAndNestedRunsAtOnce) {
  const auto device = create();
  const auto mine = std::this_thread::get_id();
  std::thread::id outer, inner;
  device->run([&] {
    outer = std::this_thread::get_id();
    device->run([&] { inner = std::this_thread::get_id(); });
  });
  EXPECT_NE(outer, mine);
  EXPECT_EQ(outer, inner);
}

TEST_P(GlDevice, PassesExceptionsThroughRunAndGoesOn) {
  const auto device = create();
  EXPECT_THROW(device->run([] { throw std::out_of_range("seven"); }), std::out_of_range);
  EXPECT_EQ(codeOf([&] { device->run([] { throw Error(ErrorCode::Gl, "no"); }); }), ErrorCode::Gl);
  expectWorks(*device);
}

TEST_P(GlDevice, ServesSeveralThreadsOneAfterTheOther) {
  const auto device = create();
  int inside = 0, most = 0, calls = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 50; ++i) {
        device->run([&] {
          most = std::max(most, ++inside);
          ++calls;
          --inside;
        });
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(calls, 200);
  EXPECT_EQ(most, 1);
}

TEST_P(GlDevice, SurvivesFloatingPointTrapsOfTheHost) {
  std::fenv_t before;
  std::fegetenv(&before);
  std::feclearexcept(FE_ALL_EXCEPT);
  feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
  const auto device = create();
  expectWorks(*device);
  int trapsInside = -1;
  device->run([&] { trapsInside = fegetexcept(); });
  EXPECT_EQ(trapsInside, 0);
  EXPECT_EQ(fegetexcept(), FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW) << "the host's traps are kept";
  std::fesetenv(&before);
}

/// The blocked signals of each of this process's threads, by thread id.
std::map<std::string, std::uint64_t> blockedSignals() {
  std::map<std::string, std::uint64_t> blocked;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream status(task.path() / "status");
    for (std::string word; status >> word;) {
      if (word != "SigBlk:") continue;
      status >> std::hex >> blocked[task.path().filename()];
      break;
    }
  }
  return blocked;
}

TEST_P(GlDevice, BlocksSignalsOnItsThreadsAndNotOnTheHosts) {
  const auto before = blockedSignals();
  const auto device = create(3);
  expectWorks(*device);
  const auto after = blockedSignals();
  EXPECT_GT(after.size(), before.size());
  for (const auto& [thread, mask] : after) {
    if (before.count(thread)) {
      EXPECT_EQ(before.at(thread), mask) << "a thread of the host";
      continue;
    }
    for (int signal : {SIGINT, SIGTERM, SIGUSR1, SIGXFSZ, SIGALRM, SIGCHLD}) {
      EXPECT_TRUE(mask >> (signal - 1) & 1) << "signal " << signal << " of thread " << thread;
    }
  }
}

TEST_P(GlDevice, UsesAllProcessorsThoughTheHostIsPinnedToOne) {
  cpu_set_t before, one, inside;
  sched_getaffinity(0, sizeof before, &before);
  CPU_ZERO(&one);
  for (int i = 0; i < CPU_SETSIZE; ++i) {
    if (CPU_ISSET(i, &before)) {
      CPU_SET(i, &one);
      break;
    }
  }
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  const auto device = create();
  expectWorks(*device);
  device->run([&] { sched_getaffinity(0, sizeof inside, &inside); });
  cpu_set_t host;
  sched_getaffinity(0, sizeof host, &host);
  sched_setaffinity(0, sizeof before, &before);
  EXPECT_TRUE(CPU_EQUAL(&host, &one)) << "the host stays where it was";
  EXPECT_GE(CPU_COUNT(&inside), CPU_COUNT(&before));
}

TEST_P(GlDevice, LeavesTheEnvironmentAsItWas) {
  unsetenv("LP_NUM_THREADS");
  char** const before = environ;
  const auto device = create(2);
  EXPECT_EQ(environ, before);
  EXPECT_EQ(std::getenv("LP_NUM_THREADS"), nullptr);
}

TEST_P(GlDevice, LeavesTheHostsOSMesaContextCurrentAndIntact) {
  HostOSMesa host;
  host.clear(0.25f, 0.5f, 0.75f);
  const auto device = create();
  expectWorks(*device);
  EXPECT_TRUE(host.isCurrent());
  EXPECT_EQ(host.clearColor(), (std::vector<float>{0.25f, 0.5f, 0.75f, 1.0f}));
  EXPECT_EQ(host.pixel(), (std::vector<unsigned char>{64, 128, 191, 255}));
  host.clear(1.0f, 0.0f, 0.0f);
  expectWorks(*device);
  EXPECT_EQ(host.pixel(), (std::vector<unsigned char>{255, 0, 0, 255}));
}

TEST_P(GlDevice, LeavesTheHostsEglContextCurrentAndIntact) {
  HostEgl host;
  host.clear(0.25f, 0.5f, 0.75f);
  {
    const auto device = create();
    expectWorks(*device);
    EXPECT_TRUE(host.isCurrent());
    EXPECT_EQ(host.pixel(), (std::vector<unsigned char>{64, 128, 191, 255}));
  }
  // Gone, and the host's display is still open.
  EXPECT_TRUE(host.isCurrent());
  host.clear(1.0f, 0.0f, 0.0f);
  EXPECT_EQ(host.pixel(), (std::vector<unsigned char>{255, 0, 0, 255}));
}

TEST_P(GlDevice, ComesAndGoesManyTimes) {
  for (int i = 0; i < 5; ++i) expectWorks(*create());
}

TEST_P(GlDevice, MayBeLetGoOfOnAnyThread) {
  auto first = create();
  auto second = create();
  first->run([&] { second.reset(); });
  expectWorks(*first);
  first->run([&] { first.reset(); });
  expectWorks(*create());
}

TEST_P(GlDevice, ShaderErrorsNameStageAndLine) {
  const auto device = create();
  std::string sentence;
  const auto compile = [&] {
    device->run([] {
      Program program({{GL_COMPUTE_SHADER,
                        "#version 430 core\nlayout(local_size_x = 1) in;\n"
                        "void main() {\n  float wrong = nowhere;\n}\n"}},
                      {{"ONE", "1"}, {"TWO", "2"}});
    });
  };
  EXPECT_EQ(codeOf(compile, &sentence), ErrorCode::Gl);
  EXPECT_NE(sentence.find("compute"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("line 4:   float wrong = nowhere;"), std::string::npos) << sentence;
}

TEST_P(GlDevice, LinkErrorsAreErrors) {
  const auto device = create();
  EXPECT_EQ(codeOf([&] {
              device->run([] {
                Program program({{GL_VERTEX_SHADER, kTriangle},
                                 {GL_FRAGMENT_SHADER,
                                  "#version 300 es\nprecision highp float;\nin vec3 nobody;\n"
                                  "out vec4 c;\nvoid main() { c = vec4(nobody, 1.0); }\n"}});
              });
            }),
            ErrorCode::Gl);
}

TEST_P(GlDevice, PendingErrorsAreThrownOnceWithTheirPlace) {
  const auto device = create();
  std::string sentence;
  EXPECT_EQ(codeOf(
                [&] {
                  device->run([] {
                    functions().Enable(GL_TRIANGLES);
                    checkErrors("the test");
                  });
                },
                &sentence),
            ErrorCode::Gl);
  EXPECT_NE(sentence.find("the test"), std::string::npos) << sentence;
  EXPECT_NO_THROW(device->run([] { checkErrors("nothing"); }));
}

TEST(GlDeviceChoice, FollowsTheEnvironmentWhenAuto) {
  setenv("VESTIGE_GL", "egl", 1);
  EXPECT_EQ(Device::create()->info().backend, "egl");
  setenv("VESTIGE_GL", "osmesa", 1);
  EXPECT_EQ(Device::create()->info().backend, "osmesa");
  EXPECT_EQ(Device::create("egl")->info().backend, "egl") << "what the caller says comes first";
  setenv("VESTIGE_GL", "vulkan", 1);
  std::string sentence;
  EXPECT_EQ(codeOf([] { Device::create(); }, &sentence), ErrorCode::InvalidArgument);
  EXPECT_NE(sentence.find("'vulkan'"), std::string::npos) << sentence;
  unsetenv("VESTIGE_GL");
  EXPECT_EQ(Device::create()->info().backend, "osmesa");
}

TEST(GlDeviceFunctions, AreAnErrorOutsideRun) {
  EXPECT_EQ(codeOf([] { functions(); }), ErrorCode::Internal);
}

}  // namespace
}  // namespace vestige::gl
