// SPDX-License-Identifier: BSD-3-Clause
//
// The C API. Checks arguments, keeps the host's floating-point environment out of our work, sends
// that work to a thread of ours, and turns exceptions into codes (error_code.h).
#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <set>
#include <utility>

#include "adaptor/api/error_code.h"
#include "adaptor/api/sized_struct.h"
#include "adaptor/api/standard_error.h"
#include "adaptor/api/worker.h"
#include "adaptor/common/adaptor_error.h"
#include "adaptor/include/vestige.h"
#include "adaptor/run/session.h"
#include "proxy/version.h"

using vestige::AdaptorError;
using vestige::FieldView;
using vestige::Location;
using vestige::SampleType;

/// A session, or what is left of one that could not be opened.
struct vestige_session {
  bool inert = false;          ///< VESTIGE_DISABLE
  int failure = VESTIGE_OK;    ///< why it is disabled
  int lastStep = VESTIGE_OK;   ///< of the last vestige_execute
  pid_t process = ::getpid();  ///< our threads do not survive a fork
  vestige_log_callback callback = nullptr;
  void* callbackData = nullptr;
  /// Convention 1. A stream that is closed now never opens: its number may go to a file.
  bool quiet = !vestige::hasStandardError();
  bool printsWarnings = false, printedError = false;
  std::set<std::string> reported;  ///< warnings of vestige_report
  std::string lastError;
  vestige::Log log;
  std::unique_ptr<vestige::Worker> worker;
  std::unique_ptr<vestige::Session> session;  ///< lives and dies on the worker
};

namespace {

thread_local std::string threadError;

[[noreturn]] void failArgument(const std::string& sentence) {
  throw AdaptorError(VESTIGE_ERROR_ARGUMENT, sentence);
}

/// Convention 1: what a host without a log hears of.
void printSentence(vestige_session& session, int level, const std::string& sentence, int code) {
  if (session.quiet) return;
  if (level == VESTIGE_ERROR && !std::exchange(session.printedError, true)) {
    vestige::printLine(fmt::format("vestige: {} ({})", sentence, vestige_code_name(code)));
  } else if (level == VESTIGE_WARNING && session.printsWarnings) {
    vestige::printLine("vestige: warning: " + sentence);
  } else if (level == VESTIGE_INFO && sentence.starts_with("dry run")) {
    vestige::printLine("vestige: " + sentence);
  }
}

/// Hands the kept sentences to the host, in its own floating-point environment. `code`: of an
/// error among them.
void flushLog(vestige_session& session, int code = VESTIGE_OK) {
  for (const auto& [level, sentence] : session.log.take()) {
    try {
      if (!session.callback) {
        printSentence(session, level, sentence, code);
        continue;
      }
      session.callback(level, sentence.c_str(), session.callbackData);
    } catch (...) {
      // A C callback cannot throw; whatever a C++ one throws, or a lack of memory, must not cross
      // us.
    }
  }
}

/// Runs `work` guarded; its exception becomes a code and the last error.
template <class Work>
int guarded(vestige_session& session, const Work& work) noexcept {
  int code = VESTIGE_OK;
  {
    const vestige::HostFloatingPoint hostsOwn;
    try {
      work();
    } catch (...) {
      code = vestige::codeOf(std::current_exception(), session.lastError);
      try {
        session.log.error(session.lastError);
      } catch (...) {
        // No memory for the log line: the code and the last error say it.
      }
    }
  }
  flushLog(session, code);
  return code;
}

/// A call on a session that may be NULL, inert, disabled or another process's.
template <class Work>
int call(vestige_session* session, const Work& work) noexcept {
  if (!session) {
    try {
      threadError = "the session is NULL";
    } catch (...) {
      threadError.clear();
    }
    return VESTIGE_ERROR_ARGUMENT;
  }
  if (session->inert) return VESTIGE_OK;
  if (session->failure != VESTIGE_OK) return session->failure;
  return guarded(*session, [&] {
    if (session->process != ::getpid()) {
      failArgument("the session was opened by another process; open one after the fork");
    }
    work(*session->session);
  });
}

/// Image libraries keep a pool of threads for the life of the process: a child that is forked after
/// the first session would wait for threads that it does not have.
void refuseForkedProcess() {
  static std::atomic<pid_t> first{0};
  pid_t expected = 0;
  const pid_t self = ::getpid();
  if (!first.compare_exchange_strong(expected, self) && expected != self) {
    failArgument(
        "this process was forked from one that had opened a session: fork first, or "
        "execute a program of its own");
  }
}

bool isDisabled() {
  const char* value = std::getenv("VESTIGE_DISABLE");
  return value && *value && std::strcmp(value, "0") != 0;
}

/// The caller's options, whatever version of the struct they are.
vestige_options copyOptions(const vestige_options* options) {
  vestige_options copy = VESTIGE_OPTIONS_INIT;
  if (!options) return copy;
  constexpr std::size_t kFirstSize = offsetof(vestige_options, log_data) + sizeof copy.log_data;
  copy = vestige::ofAnyVersion(*options, copy, kFirstSize, "vestige_options");
  if ((copy.flags & ~VESTIGE_QUIET) != 0) {
    throw AdaptorError(VESTIGE_ERROR_VERSION,
                       fmt::format("vestige_options: flags {:#x} are not known to this library, {}",
                                   unsigned(copy.flags & ~VESTIGE_QUIET), vestige::kVersion));
  }
  return copy;
}

void open(vestige_session& session, const vestige_options* given) {
  const vestige_options options = copyOptions(given);
  session.callback = options.log;
  session.callbackData = options.log_data;
  session.quiet = session.quiet || (options.flags & VESTIGE_QUIET);
  if (options.mpi_comm != VESTIGE_NO_MPI) {
    throw AdaptorError(VESTIGE_ERROR_MPI,
                       fmt::format("communicator {} is given, but this library is built without "
                                   "MPI; set mpi_comm to VESTIGE_NO_MPI",
                                   options.mpi_comm));
  }
  if (options.config && options.config_text) {
    failArgument("vestige_options: both config and config_text are given");
  }
  const std::string file = options.config ? options.config : "";
  std::string text = options.config_text ? options.config_text : "";
  const std::string output = options.output ? options.output : "";
  const char* record = std::getenv("VESTIGE_RECORD");
  const std::string recordDirectory = record ? record : "";

  refuseForkedProcess();
  session.worker = std::make_unique<vestige::Worker>();
  session.worker->run([&] {
    if (!file.empty()) text = vestige::readTextFile(file);
    auto config = vestige::configFromText(text, file.empty() ? "config" : file);
    if (!output.empty()) config.output = output;
    session.session =
        std::make_unique<vestige::Session>(config, text, recordDirectory, session.log);
  });
}

vestige::GridDescription describe(int block, const vestige_grid* given) {
  if (!given) failArgument("the grid is NULL");
  constexpr std::size_t kFirstSize = offsetof(vestige_grid, ghosts) + sizeof given->ghosts;
  const vestige_grid known =
      vestige::ofAnyVersion(*given, VESTIGE_GRID_INIT, kFirstSize, "vestige_grid");
  const vestige_grid* const grid = &known;
  vestige::requireSize(block, {grid->points[0], grid->points[1], grid->points[2]});
  vestige::GridDescription description;
  std::copy(std::begin(grid->points), std::end(grid->points), description.points.begin());
  for (std::size_t a = 0; a < 3; ++a) {
    description.first[a] = grid->first[a];
    description.origin[a] = grid->origin[a];
    description.spacing[a] = grid->spacing[a];
    if (grid->axes[a] && !description.empty()) {
      description.axes[a].emplace(grid->axes[a], grid->axes[a] + grid->points[a]);
    }
  }
  std::copy(std::begin(grid->ghosts), std::end(grid->ghosts), description.ghosts.begin());
  return description;
}

Location locationOf(int location) {
  if (location != VESTIGE_POINT && location != VESTIGE_CELL) {
    failArgument(fmt::format("location {} is neither VESTIGE_POINT nor VESTIGE_CELL", location));
  }
  return Location(location);
}

/// All but the pointers and strides of a field.
FieldView describeField(const char* name, int type, int location, int components) {
  if (!name || !*name) failArgument("a field needs a name");
  if (type < 0 || type >= vestige::kSampleTypes) {
    failArgument(fmt::format("field '{}': type {} is no vestige_type", name, type));
  }
  if (components < 1 || components > 64) {
    failArgument(fmt::format("field '{}': {} components are not in 1..64", name, components));
  }
  FieldView field;
  field.name = name;
  field.type = SampleType(type);
  field.location = locationOf(location);
  field.components.resize(std::size_t(components), nullptr);
  return field;
}

std::array<std::ptrdiff_t, 3> stridesOr(const std::ptrdiff_t* strides, std::ptrdiff_t width,
                                        const std::array<int, 3>& size) {
  if (strides) return {strides[0], strides[1], strides[2]};
  return {width, width * size[0], width * size[0] * size[1]};
}

}  // namespace

int vestige_open(const vestige_options* options, vestige_session** session) {
  if (!session) {
    threadError = "vestige_open: session is NULL";
    return VESTIGE_ERROR_ARGUMENT;
  }
  *session = new (std::nothrow) vestige_session;
  if (!*session) {
    threadError = "out of memory";
    return VESTIGE_ERROR_MEMORY;
  }
  if (isDisabled()) {
    (*session)->inert = true;
    return VESTIGE_OK;
  }
  (*session)->printsWarnings = true;
  (*session)->failure = guarded(**session, [&] { open(**session, options); });
  (*session)->printsWarnings = false;
  if ((*session)->failure != VESTIGE_OK) (*session)->worker.reset();
  return (*session)->failure;
}

int vestige_domain(vestige_session* session, const double low[3], const double high[3]) {
  return call(session, [&](vestige::Session& run) {
    if (!low || !high) failArgument("vestige_domain: a corner is NULL");
    const vestige::Box box{{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
    for (int a = 0; a < 3; ++a) {
      if (!std::isfinite(low[a]) || !std::isfinite(high[a]) || low[a] > high[a]) {
        throw AdaptorError(
            VESTIGE_ERROR_GRID,
            fmt::format("the domain reaches from {} to {} along {}", low[a], high[a], "xyz"[a]));
      }
    }
    run.blocks().setDomain(box);
  });
}

int vestige_wants(vestige_session* session, int64_t cycle, double time) {
  if (!session || !session->session) return 0;
  int wanted = 1;
  {
    const vestige::HostFloatingPoint hostsOwn;
    try {
      wanted = session->session->wants(cycle, time) ? 1 : 0;
    } catch (const std::bad_alloc&) {
      // What is not known to be unwanted is wanted: execute decides.
    }
  }
  flushLog(*session);
  return wanted;
}

int vestige_wants_field(vestige_session* session, const char* name) {
  if (!session || !session->session || !name) return 0;
  const vestige::HostFloatingPoint hostsOwn;
  try {
    return session->session->wantsField(name) ? 1 : 0;
  } catch (const std::bad_alloc&) {
    return 1;  // what is not known to be unwanted is wanted
  }
}

int vestige_block(vestige_session* session, int block, const vestige_grid* grid) {
  return call(session,
              [&](vestige::Session& run) { run.blocks().describe(block, describe(block, grid)); });
}

int vestige_share_field(vestige_session* session, int block, const char* name, int type,
                        int location, int components, const void* data,
                        const ptrdiff_t strides[4]) {
  return call(session, [&](vestige::Session& run) {
    FieldView field = describeField(name, type, location, components);
    const auto& target = run.blocks().at(block);
    if (!data && !target.grid.empty()) {
      failArgument(fmt::format("field '{}' of block {}: data is NULL", name, block));
    }
    const auto width = std::ptrdiff_t(vestige::sizeOf(field.type));
    field.strides = stridesOr(strides, width * components, target.samples(field.location));
    const auto step = strides ? strides[3] : width;
    for (int c = 0; c < components && data; ++c) {
      field.components[std::size_t(c)] = static_cast<const std::byte*>(data) + c * step;
    }
    run.blocks().share(block, std::move(field));
  });
}

int vestige_share_components(vestige_session* session, int block, const char* name, int type,
                             int location, int components, const void* const* data,
                             const ptrdiff_t strides[3]) {
  return call(session, [&](vestige::Session& run) {
    FieldView field = describeField(name, type, location, components);
    const auto& target = run.blocks().at(block);
    for (int c = 0; c < components && !target.grid.empty(); ++c) {
      if (!data || !data[c]) {
        failArgument(fmt::format("field '{}' of block {}: component {} is NULL", name, block, c));
      }
      field.components[std::size_t(c)] = static_cast<const std::byte*>(data[c]);
    }
    field.strides = stridesOr(strides, std::ptrdiff_t(vestige::sizeOf(field.type)),
                              target.samples(field.location));
    run.blocks().share(block, std::move(field));
  });
}

int vestige_share_mask(vestige_session* session, int block, int location, const uint8_t* mask,
                       uint8_t bits, const ptrdiff_t strides[3]) {
  return call(session, [&](vestige::Session& run) {
    const Location where = locationOf(location);
    const auto& target = run.blocks().at(block);
    std::optional<vestige::MaskView> view;
    if (mask) {
      view = {reinterpret_cast<const std::byte*>(mask), bits,
              stridesOr(strides, 1, target.samples(where))};
    }
    run.blocks().shareMask(block, where, view);
  });
}

int vestige_units(vestige_session* session, const char* name, const char* units) {
  return call(session, [&](vestige::Session& run) {
    if (!name || !*name || !units) failArgument("vestige_units: name or units are NULL");
    run.setUnits(name, units);
  });
}

int vestige_execute(vestige_session* session, int64_t cycle, double time) {
  const int code = call(session, [&](vestige::Session& run) {
    session->worker->run([&] { run.execute(cycle, time); });
  });
  if (session) session->lastStep = code;
  return code;
}

int vestige_report(vestige_session* session, int code, const char* sentence) {
  if (session) session->printsWarnings = true;
  const int result = call(session, [&](vestige::Session&) {
    if (!sentence || !*sentence) failArgument("vestige_report: there is no sentence");
    if (code < 0 || code > VESTIGE_ERROR_CYCLE) {
      failArgument(fmt::format("vestige_report: {} is no vestige_code", code));
    }
    if (code != VESTIGE_OK) throw AdaptorError(vestige_code(code), sentence);
    if (session->reported.insert(sentence).second) session->log.warning(sentence);
  });
  if (session) session->printsWarnings = false;
  return result;
}

int64_t vestige_stored_steps(const vestige_session* session) {
  return session && session->session ? session->session->storedSteps() : 0;
}

int vestige_close(vestige_session* session) {
  if (!session) return VESTIGE_OK;
  if (session->process != ::getpid()) {
    // After a fork our threads are the parent's: joining them here would wait for ever.
    static_cast<void>(session->session.release());
    static_cast<void>(session->worker.release());
    delete session;
    return VESTIGE_OK;
  }
  int code = session->failure != VESTIGE_OK ? session->failure : session->lastStep;
  if (session->session) {
    const int closed =
        guarded(*session, [&] { session->worker->run([&] { session->session.reset(); }); });
    if (code == VESTIGE_OK) code = closed;
  }
  delete session;
#ifdef __GLIBC__
  // What our threads freed stays with their arenas, tens of megabytes of it.
  malloc_trim(0);
#endif
  return code;
}

const char* vestige_last_error(const vestige_session* session) {
  return session ? session->lastError.c_str() : threadError.c_str();
}

const char* vestige_code_name(int code) {
  switch (code) {
#define VESTIGE_NAME(name) \
  case name:               \
    return #name
    VESTIGE_NAME(VESTIGE_OK);
    VESTIGE_NAME(VESTIGE_ERROR_ARGUMENT);
    VESTIGE_NAME(VESTIGE_ERROR_CONFIG);
    VESTIGE_NAME(VESTIGE_ERROR_NO_GL);
    VESTIGE_NAME(VESTIGE_ERROR_GL);
    VESTIGE_NAME(VESTIGE_ERROR_IO);
    VESTIGE_NAME(VESTIGE_ERROR_NO_SPACE);
    VESTIGE_NAME(VESTIGE_ERROR_FORMAT);
    VESTIGE_NAME(VESTIGE_ERROR_EXISTS);
    VESTIGE_NAME(VESTIGE_ERROR_NOT_FOUND);
    VESTIGE_NAME(VESTIGE_ERROR_INTERNAL);
    VESTIGE_NAME(VESTIGE_ERROR_MEMORY);
    VESTIGE_NAME(VESTIGE_ERROR_MPI);
    VESTIGE_NAME(VESTIGE_ERROR_VERSION);
    VESTIGE_NAME(VESTIGE_ERROR_GRID);
    VESTIGE_NAME(VESTIGE_ERROR_NO_BLOCK);
    VESTIGE_NAME(VESTIGE_ERROR_NO_FIELD);
    VESTIGE_NAME(VESTIGE_ERROR_FIELD);
    VESTIGE_NAME(VESTIGE_ERROR_CYCLE);
#undef VESTIGE_NAME
    default:
      return "unknown code";
  }
}

const char* vestige_version(void) { return vestige::kVersion; }
