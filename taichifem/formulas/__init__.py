"""Pure functions of the theory: no fields, no storage. Each names its paper."""
