/*
 * A memfd, sealed so that whoever gets it can neither write nor cut it off.
 */
#include "daemon/pictures_share.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/realtime.h"

#define PAGE_BYTES 4096

static size_t rounded(size_t size_bytes)
{
	return (size_bytes + PAGE_BYTES - 1) / PAGE_BYTES * PAGE_BYTES;
}

static size_t picture_bytes(const struct camera_mode *mode)
{
	return pixel_row_bytes(mode->format, mode->width_px) * (size_t)mode->height_px;
}

static void describe(struct picture_camera *to, const struct pictured_camera *from,
		     size_t *offset_bytes)
{
	memcpy(to->name, from->name, strnlen(from->name, PICTURES_NAME_BYTES - 1));
	to->is_hd = from->is_hd;
	snprintf(to->format, sizeof(to->format), "%s", pixel_format_name(from->granted.format));
	to->bits = (uint32_t)from->granted.bits;
	to->width_px = (uint32_t)from->granted.width_px;
	to->height_px = (uint32_t)from->granted.height_px;
	to->size_bytes = picture_bytes(&from->granted);
	for (int s = 0; s < PICTURES_SLOTS; s++) {
		to->slots[s].offset_bytes = *offset_bytes;
		*offset_bytes += rounded(to->size_bytes);
	}
}

static size_t size_of(const struct pictured_camera *cameras, uint32_t count)
{
	size_t size_bytes = rounded(sizeof(struct pictures));

	for (uint32_t c = 0; c < count; c++)
		size_bytes += PICTURES_SLOTS * rounded(picture_bytes(&cameras[c].granted));
	return size_bytes;
}

/* Our own mapping is from before the seal and stays writable. */
static int map(struct pictures_share *share)
{
	share->fd = memfd_create("stage-pictures", MFD_CLOEXEC | MFD_ALLOW_SEALING);
	if (share->fd < 0 || ftruncate(share->fd, (off_t)share->size_bytes) < 0)
		return -errno;
	void *memory =
		mmap(NULL, share->size_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, share->fd, 0);
	if (memory == MAP_FAILED)
		return -errno;
	share->memory = memory;
	if (fcntl(share->fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE) < 0)
		return -errno;
	realtime_touch(memory, share->size_bytes);
	return 0;
}

int pictures_share_open(struct pictures_share *share, const struct pictured_camera *cameras,
			uint32_t count, int64_t period_ns, struct diag *diag)
{
	size_t offset_bytes = rounded(sizeof(struct pictures));

	*share = (struct pictures_share){.size_bytes = size_of(cameras, count), .fd = -1};
	int err = map(share);
	if (err) {
		diag_add(diag, "no memory for the cameras' pictures (%zu MB): %s",
			 share->size_bytes >> 20, strerror(-err));
		pictures_share_close(share);
		return err;
	}
	struct pictures *pictures = share->memory;
	*pictures = (struct pictures){.magic = PICTURES_MAGIC,
				      .version = PICTURES_VERSION,
				      .size_bytes = share->size_bytes,
				      .period_ns = period_ns,
				      .camera_count = count};
	for (uint32_t c = 0; c < count; c++)
		describe(&pictures->cameras[c], &cameras[c], &offset_bytes);
	return 0;
}

void pictures_share_close(struct pictures_share *share)
{
	if (share->memory)
		munmap(share->memory, share->size_bytes);
	if (share->memory || share->fd > 0)
		close(share->fd);
	*share = (struct pictures_share){0};
}

static void copy(uint8_t *to, const struct frame *from)
{
	size_t row_bytes = pixel_row_bytes(from->format, from->width_px);

	if (from->size_bytes) {
		memcpy(to, from->pixels, from->size_bytes);
		return;
	}
	for (int y = 0; y < from->height_px; y++)
		memcpy(to + (size_t)y * row_bytes, from->pixels + (ptrdiff_t)y * from->stride_bytes,
		       row_bytes);
}

/* A reader that sees the same number before and after it copied has a whole picture (Boehm 2012,
 * "Can seqlocks get along with programming language memory models?"). */
void pictures_share_put(struct pictures *pictures, uint32_t camera, const struct frame *frame)
{
	struct picture_camera *to = &pictures->cameras[camera];
	uint64_t seq = atomic_load_explicit(&to->newest_seq, memory_order_relaxed) + 1;
	struct picture_slot *slot = &to->slots[seq % PICTURES_SLOTS];

	if (frame->size_bytes > to->size_bytes)
		return;
	atomic_store_explicit(&slot->seq, 0, memory_order_relaxed);
	atomic_thread_fence(memory_order_release);
	atomic_store_explicit(&slot->mid_exposure_ns, frame->mid_exposure_ns, memory_order_relaxed);
	atomic_store_explicit(&slot->jpeg_bytes, frame->size_bytes, memory_order_relaxed);
	copy((uint8_t *)pictures + slot->offset_bytes, frame);
	atomic_store_explicit(&slot->seq, seq, memory_order_release);
	atomic_store_explicit(&to->newest_seq, seq, memory_order_release);
}
