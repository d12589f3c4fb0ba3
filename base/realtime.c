/*
 * One flag per thread.
 */
#include "base/realtime.h"

#define PAGE_BYTES 4096u /* the smallest there is: larger pages are touched more than once */

static _Thread_local bool in_section;

void realtime_enter(void)
{
	in_section = true;
}

void realtime_leave(void)
{
	in_section = false;
}

bool realtime_pause(void)
{
	bool was_in_section = in_section;

	in_section = false;
	return was_in_section;
}

void realtime_resume(bool was_in_section)
{
	in_section = was_in_section;
}

bool realtime_in_section(void)
{
	return in_section;
}

void realtime_touch(void *memory, size_t size_bytes)
{
	volatile unsigned char *bytes = memory;

	for (size_t at = 0; at < size_bytes; at += PAGE_BYTES)
		bytes[at] = bytes[at];
	if (size_bytes > 0)
		bytes[size_bytes - 1] = bytes[size_bytes - 1];
}
