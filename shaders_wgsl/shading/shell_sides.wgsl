// Which sides of surfaces rays through shells see.

// Whether surfaces seen from inside are seen.
override sees_inside: bool = false;
