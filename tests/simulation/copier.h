/// Copier: makes backups as another process does, since the locks of a file are of a process. It
/// is forked before a database was opened and forks one for each backup, which costs less than
/// starting a program.
#pragma once

#include <string>

namespace simulation {

class Copier {
 public:
  Copier();
  ~Copier();
  Copier(const Copier&) = delete;
  Copier& operator=(const Copier&) = delete;

  /// Copies the data directory `from`, as `tessera-server backup` does. Returns whether it could.
  bool copy(const std::string& from, const std::string& to) const;

 private:
  int requests_ = -1;
  int answers_ = -1;
  int process_ = -1;
};

}  // namespace simulation
