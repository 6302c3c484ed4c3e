#pragma once

namespace palpate {

/// Opens /dev/null in the place of standard input, output and error where they are closed, as a
/// daemon's may be; else the first files that are opened would take their numbers, and what is
/// printed would land in them. To be called first in main().
void open_closed_streams();

/// Whether this stream (0 to 2) was closed when open_closed_streams() was called.
bool was_closed(int stream);

}  // namespace palpate
