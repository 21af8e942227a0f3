#include "core/denoise/oidn_helper.h"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <optional>
#include <vector>

#include <dlfcn.h>
#include <link.h>

#include "core/base/descriptor.h"
#include "core/base/sha256.h"
#include "core/color/rgb.h"
#include "core/denoise/oidn_protocol.h"

namespace core {
namespace {

// Constants of the library's oidn.h, 2.0 to 2.x.
using Device = struct DeviceImpl*;
using Filter = struct FilterImpl*;
constexpr int kCpu = 1;
constexpr int kFloat3 = 3;
constexpr int kBalanced = 5;
constexpr int kOldestVersion = 20000;
constexpr int kNewestVersion = 30000;
/// The library uses tiles if it would need more.
constexpr int kMemoryMb = 3000;
/// Mean luminance that the network expects.
constexpr float kMiddleGrey = 0.18F;

struct Library {
  Device (*new_device)(int) = nullptr;
  void (*set_device_int)(Device, const char*, int) = nullptr;
  void (*set_device_bool)(Device, const char*, bool) = nullptr;
  int (*get_device_int)(Device, const char*) = nullptr;
  void (*commit_device)(Device) = nullptr;
  int (*get_error)(Device, const char**) = nullptr;
  void (*release_device)(Device) = nullptr;
  Filter (*new_filter)(Device, const char*) = nullptr;
  void (*set_image)(Filter, const char*, void*, int, std::size_t, std::size_t, std::size_t,
                    std::size_t, std::size_t) = nullptr;
  void (*set_bool)(Filter, const char*, bool) = nullptr;
  void (*set_int)(Filter, const char*, int) = nullptr;
  void (*set_float)(Filter, const char*, float) = nullptr;
  void (*commit_filter)(Filter) = nullptr;
  void (*execute)(Filter) = nullptr;
  void (*release_filter)(Filter) = nullptr;
};

template <typename Function>
bool find(void* handle, const char* name, Function& function) {
  function = reinterpret_cast<Function>(dlsym(handle, name));
  return function != nullptr;
}

std::string library_in(const std::string& folder) { return folder + "/libOpenImageDenoise.so.2"; }

/// Returns an error text; empty: the library is loaded.
std::string load(const std::string& folder, Library& l) {
  const std::string path = library_in(folder);
  void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    const char* why = dlerror();
    return why != nullptr ? why : "cannot load " + path;
  }
  const bool has_all = find(handle, "oidnNewDevice", l.new_device) &&
                       find(handle, "oidnSetDeviceInt", l.set_device_int) &&
                       find(handle, "oidnSetDeviceBool", l.set_device_bool) &&
                       find(handle, "oidnGetDeviceInt", l.get_device_int) &&
                       find(handle, "oidnCommitDevice", l.commit_device) &&
                       find(handle, "oidnGetDeviceError", l.get_error) &&
                       find(handle, "oidnReleaseDevice", l.release_device) &&
                       find(handle, "oidnNewFilter", l.new_filter) &&
                       find(handle, "oidnSetSharedFilterImage", l.set_image) &&
                       find(handle, "oidnSetFilterBool", l.set_bool) &&
                       find(handle, "oidnSetFilterInt", l.set_int) &&
                       find(handle, "oidnSetFilterFloat", l.set_float) &&
                       find(handle, "oidnCommitFilter", l.commit_filter) &&
                       find(handle, "oidnExecuteFilter", l.execute) &&
                       find(handle, "oidnReleaseFilter", l.release_filter);
  return has_all ? "" : path + " is not Open Image Denoise 2";
}

using Picture = std::vector<float>;

struct Work {
  OidnRequest request;
  std::vector<Picture> pictures;
  Picture albedo;
  Picture normal;
};

std::optional<Work> read_work(int socket) {
  Work work;
  if (!read_all(socket, &work.request, sizeof(work.request))) {
    return std::nullopt;
  }
  const std::size_t count =
      std::size_t{3} * work.request.width * static_cast<std::size_t>(work.request.height);
  const auto read = [&](Picture& picture) {
    picture.resize(count);
    return read_all(socket, picture.data(), count * sizeof(float));
  };
  work.pictures.resize(work.request.pictures);
  for (Picture& picture : work.pictures) {
    if (!read(picture)) {
      return std::nullopt;
    }
  }
  if (work.request.has_features != 0 && (!read(work.albedo) || !read(work.normal))) {
    return std::nullopt;
  }
  return work;
}

/// Returns the factor for the input: from this image only, because a scale from both halves would
/// make them dependent.
float input_scale(const Picture& picture) {
  double sum = 0;
  for (std::size_t i = 0; i + 2 < picture.size(); i += 3) {
    sum += static_cast<double>(luminance({picture[i], picture[i + 1], picture[i + 2]}));
  }
  const double mean = sum / static_cast<double>(picture.size() / 3);
  return mean > 0 ? kMiddleGrey / static_cast<float>(mean) : 1;
}

std::string error_of(const Library& l, Device device) {
  const char* text = nullptr;
  return l.get_error(device, &text) != 0 ? (text != nullptr ? text : "it failed") : "";
}

std::string filter(const Library& l, Device device, Work& work, Picture& picture) {
  const auto set = [&](Filter filter, const char* name, Picture& plane) {
    l.set_image(filter, name, plane.data(), kFloat3, work.request.width, work.request.height, 0, 0,
                0);
  };
  Filter filter = l.new_filter(device, "RT");
  Picture out(picture.size());
  set(filter, "color", picture);
  if (work.request.has_features != 0) {
    set(filter, "albedo", work.albedo);
    set(filter, "normal", work.normal);
  }
  set(filter, "output", out);
  l.set_bool(filter, "hdr", true);
  l.set_float(filter, "inputScale", input_scale(picture));
  l.set_int(filter, "quality", kBalanced);
  l.set_int(filter, "maxMemoryMB", kMemoryMb);
  l.commit_filter(filter);
  l.execute(filter);
  l.release_filter(filter);
  picture.swap(out);
  return error_of(l, device);
}

/// Returns the file with the weights: a separate part of the library, which the first device loads.
std::string weights_file(const std::string& library) {
  std::string out = library;
  dl_iterate_phdr(
      [](dl_phdr_info* object, std::size_t /*bytes*/, void* found) {
        const std::string name = object->dlpi_name;
        if (name.find("libOpenImageDenoise_core") != std::string::npos) {
          *static_cast<std::string*>(found) = name;
        }
        return 0;
      },
      &out);
  return out;
}

std::string sha256_of_file(const std::string& path) {
  Sha256 hash;
  std::ifstream file(path, std::ios::binary);
  std::vector<char> part(std::size_t{1} << 20U);
  while (file.read(part.data(), static_cast<std::streamsize>(part.size())) || file.gcount() > 0) {
    hash.add(part.data(), static_cast<std::size_t>(file.gcount()));
  }
  return hash.hex();
}

/// Returns an error text; empty: the images are denoised. answer: receives the library's facts.
std::string denoise(const std::string& folder, Work& work, OidnAnswer& answer) {
  Library l;
  if (std::string fault = load(folder, l); !fault.empty()) {
    return fault;
  }
  Device device = l.new_device(kCpu);
  if (device == nullptr) {
    const std::string fault = error_of(l, nullptr);
    return fault.empty() ? "no device is available" : fault;
  }
  const int seen = l.get_device_int(device, "version");
  answer.version = static_cast<std::uint32_t>(seen);
  if (seen < kOldestVersion || seen >= kNewestVersion) {
    return "version " + std::to_string(seen / 10000) + " is not supported; 2 is";
  }
  l.set_device_int(device, "numThreads", static_cast<int>(work.request.threads));
  l.set_device_bool(device, "setAffinity", false);
  l.commit_device(device);
  std::string fault = error_of(l, device);
  for (Picture& picture : work.pictures) {
    fault = fault.empty() ? filter(l, device, work, picture) : fault;
  }
  l.release_device(device);
  const std::string sha256 = sha256_of_file(weights_file(library_in(folder)));
  std::copy(sha256.begin(), sha256.end(), answer.sha256);
  return fault;
}

}  // namespace

bool serve_oidn(int socket, const std::string& folder) {
  std::optional<Work> work = read_work(socket);
  if (!work) {
    return false;
  }
  OidnAnswer answer;
  const std::string fault = denoise(folder, *work, answer);
  answer.text_bytes = static_cast<std::uint32_t>(fault.size());
  bool sent =
      write_all(socket, &answer, sizeof(answer)) && write_all(socket, fault.data(), fault.size());
  for (const Picture& picture : work->pictures) {
    sent = sent &&
           (!fault.empty() || write_all(socket, picture.data(), picture.size() * sizeof(float)));
  }
  return sent;
}

}  // namespace core
