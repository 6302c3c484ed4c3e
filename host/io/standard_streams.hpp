#pragma once

namespace palpate {

/// Opens /dev/null in place of closed standard streams, as a daemon may have. Otherwise the first
/// files opened would take their numbers, and what is printed would go into them. Call it first in
/// main().
void open_closed_streams();

/// True where this stream (0 to 2) was closed when open_closed_streams() was called.
bool was_closed(int stream);

}  // namespace palpate
