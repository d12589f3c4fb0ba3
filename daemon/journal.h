/*
 * Log lines to systemd's journal as such, with fields that can be searched for:
 *   journalctl -u staged STAGE_CAMERA=ir3
 * Here and not in base/, because the journal's library is the daemon's: programs that only print
 * should not need it.
 */
#pragma once

/* Where standard error is the journal, lines go there with PRIORITY and, when they are about one,
 * STAGE_CAMERA and STAGE_SHOT. Elsewhere nothing changes. Before any other thread. */
void journal_begin(void);
