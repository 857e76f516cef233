"""The paper's task: a mug that lies on the table is put upright, then into a box."""
