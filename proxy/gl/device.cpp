// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/gl/device.h"

#include <algorithm>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "proxy/base/error.h"
#include "proxy/base/nearest_word.h"
#include "proxy/gl/context.h"
#include "proxy/gl/environment.h"

namespace vestige::gl {
namespace {

constexpr const char* kThreadsVariable = "LP_NUM_THREADS";

using OpenContext = std::unique_ptr<Context> (*)();

/// Devices are made one at a time: making one looks at the process's environment.
std::mutex& creationMutex() {
  static std::mutex mutex;
  return mutex;
}

std::string text(GLenum name) {
  const GLubyte* value = functions().GetString(name);
  return value ? reinterpret_cast<const char*>(value) : "";
}

DeviceInfo describe(const Context& context, int threads) {
  DeviceInfo info;
  info.backend = context.backend();
  info.vendor = text(GL_VENDOR);
  info.renderer = text(GL_RENDERER);
  info.version = text(GL_VERSION);
  int layers = 0;
  functions().GetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &info.maxTexture3D);
  functions().GetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &layers);
  info.maxTexture3D = std::min(info.maxTexture3D, layers);
  // Only Mesa's software rasteriser has threads that we choose.
  if (info.renderer.find("llvmpipe") != std::string::npos) info.threads = threads;
  return info;
}

/// What a device and its thread share: work handed over, one piece at a time. Outlives a device
/// that is let go of on its own thread.
struct Mailbox {
  std::mutex callers;  ///< held by the one caller being served
  std::mutex mutex;    ///< guards what follows
  std::condition_variable changed;
  const std::function<void()>* work = nullptr;
  bool done = false, stop = false;
  std::exception_ptr error;

  DeviceInfo info;  ///< written before the first `done`
};

void serve(Mailbox& mailbox) {
  std::unique_lock lock(mailbox.mutex);
  while (true) {
    mailbox.changed.wait(lock, [&] { return mailbox.work || mailbox.stop; });
    if (!mailbox.work) return;
    const auto* work = mailbox.work;
    std::exception_ptr error;
    lock.unlock();
    try {
      (*work)();
    } catch (...) {
      error = std::current_exception();
    }
    lock.lock();
    mailbox.work = nullptr;
    mailbox.error = error;
    mailbox.done = true;
    mailbox.changed.notify_all();
  }
}

/// llvmpipe sizes its pool by the affinity of the process's first thread, which a host may have
/// pinned: say how many we want, unless the user's own environment does. `threads` becomes the
/// number said.
std::unique_ptr<Context> openWithThreads(OpenContext open, int& threads) {
  const char* chosen = threads > 0 ? nullptr : std::getenv(kThreadsVariable);
  if (chosen) {
    threads = std::atoi(chosen);
    return open();
  }
  if (threads <= 0) threads = allowedProcessors();
  const ScopedEnvironment scoped(kThreadsVariable, std::to_string(threads));
  return open();
}

/// Mesa prints what it tries in vain (a cache, a GPU that is not ours): of that it says nothing
/// while it opens, unless the user's own environment wants to know. It reads these once a process.
std::unique_ptr<Context> openQuietly(OpenContext open, int& threads) {
  std::vector<std::unique_ptr<ScopedEnvironment>> scoped;
  struct LastFirst {
    std::vector<std::unique_ptr<ScopedEnvironment>>& scoped;
    ~LastFirst() {
      while (!scoped.empty()) scoped.pop_back();
    }
  } const lastFirst{scoped};
  for (const auto& [name, value] : {std::pair{"EGL_LOG_LEVEL", "fatal"},
                                    {"LIBGL_DEBUG", "quiet"},
                                    {"MESA_LOG_FILE", "/dev/null"}}) {
    if (!std::getenv(name)) scoped.push_back(std::make_unique<ScopedEnvironment>(name, value));
  }
  if (!hasShaderCache()) {
    scoped.push_back(std::make_unique<ScopedEnvironment>("MESA_SHADER_CACHE_DISABLE", "true"));
  }
  return openWithThreads(open, threads);
}

/// The whole life of a device's thread; the first `done` says that it is open or has failed.
void threadMain(Mailbox& mailbox, OpenContext open, int threads) {
  std::unique_ptr<Context> context;
  std::exception_ptr error;
  try {
    resetThread();
    context = openQuietly(open, threads);
    setThreadFunctions(&context->functions());
    mailbox.info = describe(*context, threads);
  } catch (...) {
    error = std::current_exception();
    context.reset();
  }
  {
    const std::lock_guard lock(mailbox.mutex);
    mailbox.error = error;
    mailbox.done = true;
  }
  mailbox.changed.notify_all();
  if (!error) serve(mailbox);
  setThreadFunctions(nullptr);
}

void waitUntilDone(Mailbox& mailbox, std::unique_lock<std::mutex>& lock) {
  mailbox.changed.wait(lock, [&] { return mailbox.done; });
  mailbox.done = false;
  if (auto error = std::exchange(mailbox.error, nullptr)) std::rethrow_exception(error);
}

class ThreadDevice final : public Device {
 public:
  ThreadDevice(OpenContext open, int threads) {
    const std::lock_guard creating(creationMutex());
    // The first instruction of the new thread, and every thread that Mesa starts from it, has all
    // signals blocked.
    const SignalsBlocked blocked;
    thread_ =
        std::thread([mailbox = mailbox_, open, threads] { threadMain(*mailbox, open, threads); });
    try {
      std::unique_lock lock(mailbox_->mutex);
      waitUntilDone(*mailbox_, lock);
    } catch (...) {
      thread_.join();
      throw;
    }
  }

  ~ThreadDevice() override {
    {
      const std::lock_guard lock(mailbox_->mutex);
      mailbox_->stop = true;
    }
    mailbox_->changed.notify_all();
    if (std::this_thread::get_id() == thread_.get_id()) {
      thread_.detach();
    } else {
      thread_.join();
    }
  }

  void run(const std::function<void()>& work) override {
    if (std::this_thread::get_id() == thread_.get_id()) return work();
    const auto mailbox = mailbox_;  // `work` may let go of this device
    const std::lock_guard oneCaller(mailbox->callers);
    std::unique_lock lock(mailbox->mutex);
    mailbox->work = &work;
    mailbox->changed.notify_all();
    waitUntilDone(*mailbox, lock);
  }

  const DeviceInfo& info() const override { return mailbox_->info; }

 private:
  std::shared_ptr<Mailbox> mailbox_ = std::make_shared<Mailbox>();
  std::thread thread_;
};

}  // namespace

std::shared_ptr<Device> Device::createOSMesa(int threads) {
  return std::make_shared<ThreadDevice>(&openOSMesa, threads);
}

std::shared_ptr<Device> Device::createEgl(int threads) {
  return std::make_shared<ThreadDevice>(&openEgl, threads);
}

std::shared_ptr<Device> Device::create(const std::string& backend, int threads) {
  std::string choice = backend;
  if (choice == "auto") {
    const char* wish = std::getenv("VESTIGE_GL");
    if (wish && *wish) choice = wish;
  }
  if (choice == "osmesa") return createOSMesa(threads);
  if (choice == "egl") return createEgl(threads);
  if (choice != "auto") {
    throw Error(ErrorCode::InvalidArgument, "the OpenGL backend '" + choice +
                                                "' is none of osmesa, egl, auto" +
                                                didYouMean(choice, {"osmesa", "egl", "auto"}));
  }
  std::string reason;
  try {
    return createOSMesa(threads);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::NoGl) throw;
    reason = e.what();
  }
  try {
    return createEgl(threads);
  } catch (const Error& e) {
    if (e.code() != ErrorCode::NoGl) throw;
    throw Error(ErrorCode::NoGl, reason + "; and " + e.what());
  }
}

bool DeviceInfo::isSoftware() const {
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "SwiftShader"}) {
    if (renderer.find(name) != std::string::npos) return true;
  }
  return false;
}

}  // namespace vestige::gl
