// Part of every program built with AddressSanitizer. Mesa's driver keeps what it allocates once and is unloaded before
// leaks are counted, so that what it still points to looks leaked and its frames have no name to suppress. A library
// that stays in memory leaks nothing.
extern "C" int dlclose(void*);
extern "C" int dlclose(void*) { return 0; }
