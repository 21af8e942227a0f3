// A library with the interface of Open Image Denoise 2 that follows FAKE_OIDN: crashes, hangs,
// fails, or reports another version; by default it darkens the image by a tenth.
#include <cstdlib>
#include <cstring>
#include <string>

#include <signal.h>
#include <unistd.h>

namespace {

bool is(const char* fault) {
  const char* asked = std::getenv("FAKE_OIDN");
  return asked != nullptr && std::strcmp(asked, fault) == 0;
}

struct FakeFilter {
  const float* color = nullptr;
  float* output = nullptr;
  std::size_t values = 0;
};
int g_device = 0;
FakeFilter g_filter;

}  // namespace

extern "C" {

int* oidnNewDevice(int) { return &g_device; }
void oidnSetDeviceInt(int*, const char*, int) {}
void oidnSetDeviceBool(int*, const char*, bool) {}
int oidnGetDeviceInt(int*, const char*) { return is("version 3") ? 30001 : 20501; }
void oidnCommitDevice(int*) {}
int oidnGetDeviceError(int*, const char** text) {
  *text = "out of\nmemory";
  return is("fail") ? 4 : 0;
}
void oidnReleaseDevice(int*) {}
FakeFilter* oidnNewFilter(int*, const char*) { return &g_filter; }
void oidnSetSharedFilterImage(FakeFilter* filter, const char* name, void* at, int,
                              std::size_t width, std::size_t height, std::size_t, std::size_t,
                              std::size_t) {
  filter->values = 3 * width * height;
  if (std::string(name) == "color") {
    filter->color = static_cast<const float*>(at);
  } else if (std::string(name) == "output") {
    filter->output = static_cast<float*>(at);
  }
}
void oidnSetFilterBool(FakeFilter*, const char*, bool) {}
void oidnSetFilterInt(FakeFilter*, const char*, int) {}
void oidnSetFilterFloat(FakeFilter*, const char*, float) {}
void oidnCommitFilter(FakeFilter*) {}
void oidnExecuteFilter(FakeFilter* filter) {
  if (is("crash")) {
    ::kill(::getpid(), SIGKILL);  // as a fault would, without a core file
  }
  while (is("hang")) {
    ::pause();
  }
  for (std::size_t i = 0; i < filter->values; ++i) {
    filter->output[i] = 0.9F * filter->color[i];
  }
}
void oidnReleaseFilter(FakeFilter*) {}

}  // extern "C"
