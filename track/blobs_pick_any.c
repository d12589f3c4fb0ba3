/*
 * Which of the scans that give the same bits runs best on this processor.
 */
#include "track/blobs_parts.h"

blob_scan_fn *blob_scan_best(void)
{
	return blob_scan_simd;
}
