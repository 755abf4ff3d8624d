// SPDX-License-Identifier: BSD-3-Clause
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "proxy/base/error.h"
#include "proxy/format/exr/exr_file.h"
#include "proxy/format/exr/exr_header.h"
#include "proxy/format/exr/exr_scan.h"
#include "proxy/format/exr/exr_threads.h"
#include "proxy/format/image/length_unit.h"
#include "proxy/format/image/storage_scale.h"

namespace vestige {
namespace {

[[noreturn]] void unreadable(const std::filesystem::path& path, const std::string& reason) {
  throw Error(ErrorCode::Io, "cannot read '" + path.string() + "': " + reason);
}
[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& reason) {
  throw Error(ErrorCode::Format, "'" + path.string() + "' is not a readable proxy: " + reason);
}

/// Does not wait for a writer when the path is a pipe's.
int openToRead(const std::filesystem::path& path) {
  return ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
}

/// A file read by position. OpenEXR serialises its calls.
class FileStream : public Imf::IStream {
 public:
  explicit FileStream(const std::filesystem::path& path)
      : Imf::IStream(path.c_str()), path_(path), fd_(openToRead(path)) {
    struct stat status;
    if (fd_ < 0 || ::fstat(fd_, &status) != 0) {
      int reason = errno;
      if (fd_ >= 0) ::close(fd_);
      unreadable(path, std::generic_category().message(reason));
    }
    if (!S_ISREG(status.st_mode)) {
      ::close(fd_);
      unreadable(path, "it is no regular file");
    }
    size_ = std::uint64_t(status.st_size);
    // Holes hold no picture. Some file systems do not count blocks and say 0.
    const std::uint64_t allocated = std::uint64_t(status.st_blocks) * 512;
    solid_ = allocated > 0 ? std::min(size_, allocated) : size_;
  }
  ~FileStream() override { ::close(fd_); }

  std::uint64_t size() const { return size_; }
  /// What of it takes room on the disk.
  std::uint64_t solidBytes() const { return solid_; }
  void readAt(std::uint64_t offset, std::size_t n, char* out) const {
    while (n > 0) {
      ssize_t got = ::pread(fd_, out, n, off_t(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) unreadable(path_, std::generic_category().message(errno));
      if (got == 0) refuse(path_, "it ends too early");
      out += got, offset += std::uint64_t(got), n -= std::size_t(got);
    }
  }
  bool read(char c[], int n) override {
    if (n < 0 || at_ > size_ || std::uint64_t(n) > size_ - at_) refuse(path_, "it ends too early");
    const std::size_t count = std::size_t(n);
    if (count > kAhead) {
      readAt(at_, count, c);
    } else {
      // OpenEXR reads headers byte by byte.
      if (at_ < aheadAt_ || at_ + count > aheadAt_ + ahead_.size()) {
        ahead_.resize(std::size_t(std::min<std::uint64_t>(kAhead, size_ - at_)));
        aheadAt_ = size_;  // nothing is there if reading fails
        readAt(at_, ahead_.size(), ahead_.data());
        aheadAt_ = at_;
      }
      std::copy_n(ahead_.data() + (at_ - aheadAt_), count, c);
    }
    at_ += count;
    return at_ < size_;
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t pos) override { at_ = pos; }

 private:
  static constexpr std::size_t kAhead = 8192;

  std::filesystem::path path_;
  int fd_;
  std::uint64_t size_ = 0, solid_ = 0, at_ = 0;
  std::vector<char> ahead_;  ///< bytes of the file from aheadAt_ on
  std::uint64_t aheadAt_ = 0;
};

}  // namespace

struct ExrFile::Impl {
  std::filesystem::path path;
  FileStream stream;
  std::unique_ptr<Imf::MultiPartInputFile> file;
  ProxyHeader header;
  std::vector<PartLayout> layouts;
  double lengthUnit;

  Impl(std::filesystem::path p, double unit) : path(std::move(p)), stream(path), lengthUnit(unit) {
    scanExr(path, stream.size(), [this](std::uint64_t offset, std::size_t n, char* out) {
      stream.readAt(offset, n, out);
    });
    ensureExrThreads();
    guarded([&] {
      file = std::make_unique<Imf::MultiPartInputFile>(stream, Imf::globalThreadCount(), false);
      header = proxyHeaderFrom(file->header(0));
      for (int i = 0; i < file->parts(); ++i) layouts.push_back(partLayoutFrom(file->header(i)));
    });
    checkLayouts();
    if (lengthUnit != 1.0) guarded([&] { scaleLengths(header, 1.0 / lengthUnit); });
  }

  /// OpenEXR's exceptions, and ours without a file name, become Format with file and reason.
  template <typename Work>
  auto guarded(const Work& work) const -> decltype(work()) {
    try {
      return work();
    } catch (const Error& e) {
      if (e.code() != ErrorCode::Format ||
          std::string_view(e.what()).find(path.string()) != std::string_view::npos)
        throw;
      refuse(path, e.what());
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& e) {
      refuse(path, e.what());
    }
  }

  void checkLayouts() const {
    std::uint64_t pictureBytes = 0;
    for (std::size_t i = 0; i < layouts.size(); ++i) {
      const Imf::ChannelList& stored = file->header(int(i)).channels();
      for (const ChannelLayout& c : layouts[i].channels) {
        const bool half = c.storage == ChannelStorage::Half;
        pictureBytes += header.size.pixels() * (half ? 2u : 4u);
        if (c.constant) continue;
        const Imf::Channel* found = stored.findChannel(c.name);
        if (!found || found->type != (half ? Imf::HALF : Imf::FLOAT))
          refuse(path, "part '" + layouts[i].name + "' has no channel '" + c.name +
                           "' of the type that it states");
      }
    }
    if (!pictureFitsFile(pictureBytes, stream.solidBytes()))
      refuse(path, "it claims pictures of " + std::to_string(pictureBytes) +
                       " bytes in a file of " + std::to_string(stream.solidBytes()));
  }

  int indexOf(const std::string& part) const {
    for (std::size_t i = 0; i < layouts.size(); ++i)
      if (layouts[i].name == part) return int(i);
    throw Error(ErrorCode::NotFound, "'" + path.string() + "' has no part '" + part + "'");
  }
  ProxyPart decode(int number) const;
};

namespace {

/// Stored numbers to in-memory ones, inside the data window.
void restore(const StorageScale& scale, const Imath::Box2i& window, int width, float* plane) {
  if (scale.identity()) return;
  for (int y = window.min.y; y <= window.max.y; ++y) {
    float* row = plane + std::ptrdiff_t(y) * width;
    for (int x = window.min.x; x <= window.max.x; ++x) row[x] = scale.memory(row[x]);
  }
}

}  // namespace

ProxyPart ExrFile::Impl::decode(int number) const {
  const PartLayout& layout = layouts[std::size_t(number)];
  const Imath::Box2i window = file->header(number).dataWindow();
  const int width = header.size.width;
  const double factor = 1.0 / lengthUnit;
  const auto factorOf = [&](std::string_view channel) {
    return isLength(header.kind, layout.name, channel) ? factor : 1.0;
  };
  ProxyPart part{layout.name, layout.unit, layout.zero, layout.error, {}};
  if (isLength(header.kind, layout.name)) part.unit *= factor, part.zero *= factor;
  if (!layout.channels.empty()) part.error *= factorOf(layout.channels.front().name);
  part.channels.resize(layout.channels.size());
  forEachOnExrThreads(int(part.channels.size()), [&](int i) {
    const ChannelLayout& c = layout.channels[std::size_t(i)];
    part.channels[std::size_t(i)] = {
        c.name, c.storage,
        std::vector<float>(header.size.pixels(), float(double(c.fill) * factorOf(c.name)))};
  });
  Imf::FrameBuffer frame;
  for (std::size_t i = 0; i < part.channels.size(); ++i)
    if (!layout.channels[i].constant)
      frame.insert(part.channels[i].name,
                   Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(part.channels[i].values.data()),
                              sizeof(float), sizeof(float) * std::size_t(width)));
  guarded([&] {
    Imf::InputPart in(*file, number);
    in.setFrameBuffer(frame);
    in.readPixels(window.min.y, window.max.y);
  });
  forEachOnExrThreads(int(part.channels.size()), [&](int i) {
    const ChannelLayout& c = layout.channels[std::size_t(i)];
    const double by = factorOf(c.name);
    if (!c.constant)
      restore(scaleOfPart(layout.name, layout.unit * by, layout.zero * by), window, width,
              part.channels[std::size_t(i)].values.data());
  });
  return part;
}

ExrFile::ExrFile(std::filesystem::path path, double lengthUnit)
    : impl_(std::make_unique<Impl>(std::move(path), lengthUnit)) {}
ExrFile::~ExrFile() = default;
ExrFile::ExrFile(ExrFile&&) noexcept = default;
ExrFile& ExrFile::operator=(ExrFile&&) noexcept = default;

const std::filesystem::path& ExrFile::path() const { return impl_->path; }
double ExrFile::lengthUnit() const { return impl_->lengthUnit; }
const ProxyHeader& ExrFile::header() const { return impl_->header; }

std::vector<std::string> ExrFile::partNames() const {
  std::vector<std::string> names;
  for (const PartLayout& layout : impl_->layouts) names.push_back(layout.name);
  return names;
}

bool ExrFile::has(const std::string& part) const {
  return std::any_of(impl_->layouts.begin(), impl_->layouts.end(),
                     [&](const PartLayout& layout) { return layout.name == part; });
}

double ExrFile::unitOf(const std::string& part) const {
  const double unit = impl_->layouts[std::size_t(impl_->indexOf(part))].unit;
  return isLength(impl_->header.kind, part) ? unit / impl_->lengthUnit : unit;
}

ProxyPart ExrFile::part(const std::string& name) const {
  return impl_->decode(impl_->indexOf(name));
}

ProxyImage ExrFile::image() const {
  ProxyImage image{impl_->header, {}};
  for (std::size_t i = 0; i < impl_->layouts.size(); ++i)
    image.parts.push_back(impl_->decode(int(i)));
  return image;
}

}  // namespace vestige
