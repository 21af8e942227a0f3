/// What is left to a process that reads files of strangers.
#pragma once

namespace core {

/// Leaves the process memory, its open files and its end; any other system call fails with EPERM:
/// it opens no file, socket or process. Returns false if the kernel refuses.
bool confine();

}  // namespace core
