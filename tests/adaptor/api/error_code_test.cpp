// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/api/error_code.h"

#include <fenv.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <new>

#include "adaptor/api/worker.h"
#include "adaptor/common/adaptor_error.h"
#include "proxy/base/parallel.h"

namespace vestige {
namespace {

template <class Exception>
vestige_code codeFor(const Exception& exception, std::string& sentence) {
  return codeOf(std::make_exception_ptr(exception), sentence);
}

TEST(ErrorCode, EveryReasonKeepsItsCodeAndSentence) {
  std::string sentence;
  for (int code = 1; code <= 10; ++code) {
    EXPECT_EQ(codeFor(Error(ErrorCode(code), "because"), sentence), code);
    EXPECT_EQ(sentence, "because");
  }
  for (int code = 11; code <= 18; ++code) {
    EXPECT_EQ(codeFor(AdaptorError(vestige_code(code), "so"), sentence), code);
    EXPECT_EQ(sentence, "so");
  }
}

TEST(ErrorCode, ForeignExceptionsHaveACodeToo) {
  std::string sentence;
  EXPECT_EQ(codeFor(std::bad_alloc(), sentence), VESTIGE_ERROR_MEMORY);
  EXPECT_EQ(codeFor(std::length_error("vector"), sentence), VESTIGE_ERROR_MEMORY);
  EXPECT_EQ(codeFor(std::filesystem::filesystem_error("x", std::error_code()), sentence),
            VESTIGE_ERROR_IO);
  EXPECT_EQ(codeFor(std::logic_error("a fault"), sentence), VESTIGE_ERROR_INTERNAL);
  EXPECT_EQ(sentence, "a fault");
  EXPECT_EQ(codeFor(42, sentence), VESTIGE_ERROR_INTERNAL);
}

TEST(Worker, RunsWithACleanFloatingPointEnvironment) {
  fenv_t before;
  fegetenv(&before);
  feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
  fesetround(FE_UPWARD);
  int traps = -1, rounding = -1;
  {
    Worker worker;
    worker.run([&] {
      volatile double zero = 0.0;
      volatile double nan = zero / zero;
      (void)nan;
      traps = fegetexcept();
      rounding = fegetround();
    });
  }
  const int hostTraps = fegetexcept(), hostRounding = fegetround();
  fesetenv(&before);
  EXPECT_EQ(traps, 0);
  EXPECT_EQ(rounding, FE_TONEAREST);
  EXPECT_EQ(hostTraps, FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
  EXPECT_EQ(hostRounding, FE_UPWARD);
}

TEST(Worker, HandsExceptionsToTheCallerAndGoesOn) {
  Worker worker;
  EXPECT_THROW(worker.run([] { throw std::runtime_error("no"); }), std::runtime_error);
  bool ran = false;
  worker.run([&] { ran = true; });
  EXPECT_TRUE(ran);
}

TEST(Worker, HostFloatingPointIsPutBack) {
  fenv_t before;
  fegetenv(&before);
  feclearexcept(FE_ALL_EXCEPT);
  feenableexcept(FE_DIVBYZERO);
  {
    const HostFloatingPoint hostsOwn;
    volatile double zero = 0.0;
    volatile double infinity = 1.0 / zero;
    (void)infinity;
  }
  const int traps = fegetexcept(), raised = fetestexcept(FE_ALL_EXCEPT);
  fesetenv(&before);
  EXPECT_EQ(traps, FE_DIVBYZERO);
  EXPECT_EQ(raised, 0);
}

TEST(ParallelFor, CallsEveryTaskOnceAndPassesOnExceptions) {
  std::vector<std::atomic<int>> calls(100);
  parallelFor(100, 4, [&](int i) { ++calls[std::size_t(i)]; });
  for (const auto& count : calls) EXPECT_EQ(count, 1);
  EXPECT_THROW(parallelFor(100, 4,
                           [](int i) {
                             if (i == 50) throw std::bad_alloc();
                           }),
               std::bad_alloc);
  parallelFor(0, 4, [](int) { FAIL(); });
}

}  // namespace
}  // namespace vestige
