// Read by AddressSanitizer's run-time library in every build that has one.

/// umockdev's library stands before the sanitizer's, and GLib keeps what it allocates.
extern "C" const char* __asan_default_options() {  // NOLINT(bugprone-reserved-identifier)
  return "verify_asan_link_order=0:detect_leaks=0";
}
