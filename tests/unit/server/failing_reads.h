/// Reads of files that fail with EIO.
#pragma once

namespace test_support {

/// Lets the calling thread make that many reads; the next one fails.
void fail_read_after(int reads);
/// Ends that. Returns whether a read has failed.
bool end_failing_reads();

}  // namespace test_support
