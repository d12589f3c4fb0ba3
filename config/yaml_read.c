/*
 * Mappings by a table of keys, and lists; yaml_scalar.c reads the values.
 */
#include <string.h>

#include "config/yaml.h"

/* Where the node stands, or `otherwise` when it has no text of its own. */
static struct yaml_place place_of(struct fy_node *node, struct yaml_place otherwise)
{
	while (node && !fy_node_is_scalar(node))
		if (fy_node_is_sequence(node)) {
			node = fy_node_sequence_get_by_index(node, 0);
		} else {
			struct fy_node_pair *pair = fy_node_mapping_get_by_index(node, 0);

			node = pair ? fy_node_pair_key(pair) : NULL;
		}

	struct fy_token *token = node ? fy_node_get_scalar_token(node) : NULL;
	const struct fy_mark *mark = token ? fy_token_start_mark(token) : NULL;

	/* where nothing stands, versions of the library differ */
	if (!mark || (fy_node_get_style(node) == FYNS_PLAIN && !fy_token_get_text_length(token)))
		return otherwise;
	/* the mark stands behind a quote or an asterisk */
	bool marked = fy_node_get_style(node) == FYNS_ALIAS ||
		      fy_node_get_style(node) == FYNS_SINGLE_QUOTED ||
		      fy_node_get_style(node) == FYNS_DOUBLE_QUOTED;
	return (struct yaml_place){mark->line + 1, mark->column + !marked};
}

struct yaml_value yaml_root(const struct yaml *yaml)
{
	struct fy_node *root = fy_document_root(yaml->document);

	return (struct yaml_value){root, "", place_of(root, (struct yaml_place){1, 1})};
}

/* Levenshtein's distance, up to 31 characters a word. */
static int edit_distance(const char *a, size_t a_length, const char *b)
{
	int row[32], b_length = (int)strlen(b);

	if (a_length > 31 || b_length > 31)
		return 99;
	for (int j = 0; j <= b_length; j++)
		row[j] = j;
	for (int i = 1; i <= (int)a_length; i++) {
		int diagonal = row[0];

		row[0] = i;
		for (int j = 1; j <= b_length; j++) {
			int change = diagonal + (a[i - 1] != b[j - 1]);
			int other = 1 + (row[j] < row[j - 1] ? row[j] : row[j - 1]);

			diagonal = row[j];
			row[j] = change < other ? change : other;
		}
	}
	return row[b_length];
}

static void complain_unknown(struct yaml *yaml, struct yaml_place place, const char *field,
			     const char *text, size_t length, const struct yaml_key *keys)
{
	const char *nearest = NULL;
	int least = 4;
	char known[512] = "";

	if (yaml->diag && yaml->diag->count > DIAG_MAX) { /* a file of nonsense: only count */
		yaml_complain(yaml, place, field, "unknown key");
		return;
	}
	for (const struct yaml_key *key = keys; key->name; key++) {
		int distance = edit_distance(text, length, key->name);
		size_t used = strlen(known);

		snprintf(known + used, sizeof(known) - used, "%s%s", used ? ", " : "", key->name);
		if (distance < least && distance < (int)strlen(key->name)) {
			least = distance;
			nearest = key->name;
		}
	}
	if (nearest)
		yaml_complain(yaml, place, field, "unknown key; did you mean '%s'?", nearest);
	else
		yaml_complain(yaml, place, field, "unknown key; known here: %s", known);
}

static void read_value(struct yaml *yaml, const struct yaml_value *value,
		       const struct yaml_key *key, void *target)
{
	if (value->node && fy_node_is_alias(value->node))
		yaml_complain(yaml, value->place, value->field,
			      "aliases (*) are not read here; write the value out");
	else if (key->kind == YAML_CUSTOM)
		key->read(yaml, value, target);
	else
		yaml_read_scalar(yaml, value, key, (char *)target + key->offset);
}

static const struct yaml_key *find_key(const struct yaml_key *keys, const char *text, size_t length)
{
	for (const struct yaml_key *key = keys; key->name; key++)
		if (strlen(key->name) == length && memcmp(key->name, text, length) == 0)
			return key;
	return NULL;
}

static void join_field(char field[YAML_FIELD_BYTES], const char *prefix, const char *name,
		       size_t length)
{
	snprintf(field, YAML_FIELD_BYTES, "%s%s%.*s", prefix, *prefix ? "." : "",
		 length < 40 ? (int)length : 40, name);
}

static void read_pair(struct yaml *yaml, const struct yaml_value *mapping,
		      struct fy_node_pair *pair, const struct yaml_key *keys, void *target,
		      struct yaml_place *places)
{
	struct fy_node *key_node = fy_node_pair_key(pair), *node = fy_node_pair_value(pair);
	struct yaml_place place = place_of(key_node, mapping->place);
	char field[YAML_FIELD_BYTES];
	size_t length = 0;
	const char *text = NULL;

	if (key_node && fy_node_is_scalar(key_node) && !fy_node_is_alias(key_node))
		text = fy_node_get_scalar(key_node, &length);
	if (!text) {
		yaml_complain(yaml, place, mapping->field, "a key must be a plain word");
		return;
	}
	join_field(field, mapping->field, text, length);

	const struct yaml_key *key = find_key(keys, text, length);

	if (!key) {
		complain_unknown(yaml, place, field, text, length, keys);
		return;
	}
	struct yaml_place *first = &places[key - keys];
	if (first->line) {
		yaml_complain(yaml, place, field, "given twice, first in line %d", first->line);
		return;
	}
	struct yaml_value value = {node, field, place_of(node, place)};
	*first = value.place;
	read_value(yaml, &value, key, target);
}

#define KEYS_MAX 32 /* of one table */

void yaml_read_mapping(struct yaml *yaml, const struct yaml_value *value,
		       const struct yaml_key *keys, void *target, struct yaml_place *places)
{
	struct yaml_place own[KEYS_MAX] = {{0}};
	struct fy_node_pair *pair;
	void *iterator = NULL;

	if (!value->node || !fy_node_is_mapping(value->node)) {
		yaml_complain(yaml, value->place, value->field,
			      "expected 'key: value' lines, beginning with %s", keys[0].name);
		return;
	}
	while ((pair = fy_node_mapping_iterate(value->node, &iterator)))
		read_pair(yaml, value, pair, keys, target, own);
	for (int i = 0; keys[i].name; i++) {
		char field[YAML_FIELD_BYTES];

		join_field(field, value->field, keys[i].name, strlen(keys[i].name));
		if (keys[i].required && !own[i].line)
			yaml_complain(yaml, value->place, field, "missing");
		if (places)
			places[i] = own[i];
	}
}

bool yaml_next_pair(struct yaml *yaml, const struct yaml_value *mapping, void **iterator,
		    char *name, size_t name_bytes, struct yaml_value *item,
		    char field[YAML_FIELD_BYTES])
{
	struct fy_node_pair *pair;
	const char *text = NULL;
	size_t length = 0;

	if (!mapping->node || !fy_node_is_mapping(mapping->node)) {
		yaml_complain(yaml, mapping->place, mapping->field, "expected 'name: value' lines");
		return false;
	}
	pair = fy_node_mapping_iterate(mapping->node, iterator);
	if (!pair)
		return false;

	struct fy_node *key = fy_node_pair_key(pair), *node = fy_node_pair_value(pair);
	struct yaml_place place = place_of(key, mapping->place);

	if (key && fy_node_is_scalar(key) && !fy_node_is_alias(key))
		text = fy_node_get_scalar(key, &length);
	if (!text || length == 0 || length >= name_bytes || memchr(text, 0, length)) {
		yaml_complain(yaml, place, mapping->field,
			      "a name must be a plain word of at most %zu characters",
			      name_bytes - 1);
		return false;
	}
	memcpy(name, text, length);
	name[length] = '\0';
	join_field(field, mapping->field, name, length);
	*item = (struct yaml_value){node, field, place_of(node, place)};
	return true;
}

bool yaml_next_item(struct yaml *yaml, const struct yaml_value *sequence, void **iterator,
		    int *index, struct yaml_value *item, char field[YAML_FIELD_BYTES])
{
	if (!sequence->node || !fy_node_is_sequence(sequence->node)) {
		yaml_complain(yaml, sequence->place, sequence->field, "expected a list");
		return false;
	}

	struct fy_node *node = fy_node_sequence_iterate(sequence->node, iterator);

	if (!node)
		return false;
	snprintf(field, YAML_FIELD_BYTES, "%s[%d]", sequence->field, ++*index);
	*item = (struct yaml_value){node, field, place_of(node, sequence->place)};
	return true;
}

int yaml_read_list(struct yaml *yaml, const struct yaml_value *list, int max, const char *what,
		   void (*read)(struct yaml *yaml, const struct yaml_value *item, void *target),
		   void *target)
{
	struct yaml_value item;
	char field[YAML_FIELD_BYTES];
	void *iterator = NULL;
	int index = -1;

	while (yaml_next_item(yaml, list, &iterator, &index, &item, field)) {
		if (index == max) {
			yaml_complain(yaml, item.place, field, "more than %d %s", max, what);
			return max;
		}
		read(yaml, &item, target);
	}
	return index + 1;
}

bool yaml_read_numbers(struct yaml *yaml, const struct yaml_value *value,
		       const struct yaml_key *key, double *numbers, int count)
{
	struct yaml_value item;
	char field[YAML_FIELD_BYTES];
	void *iterator = NULL;
	bool failed_before = yaml->failed;
	int index = -1;

	yaml->failed = false;
	while (yaml_next_item(yaml, value, &iterator, &index, &item, field))
		if (index < count)
			yaml_read_scalar(yaml, &item, key, &numbers[index]);
	if (index + 1 != count && fy_node_is_sequence(value->node))
		yaml_complain(yaml, value->place, value->field,
			      "expected %d numbers in %s, found %d", count, key->unit, index + 1);
	bool good = !yaml->failed;

	yaml->failed |= failed_before;
	return good;
}
